"""Limits the pictures in transit: a browser gets a new one only after it has received the last one but one.

Without this limit, a browser that paints more slowly than frames are made would lag further with each of them.
"""

import threading
import time
from collections import deque
from typing import Any

PATIENCE = 2.0
"""Time after which the page stops waiting for a browser that does not answer [s]: a sleeping tab, a lost connection."""


class FrameThrottle:
    """Asks each browser after each picture, and notes when the answer arrives.

    Args:
        server: The viser server.
    """

    def __init__(self, server: Any):
        self._changed = threading.Condition()
        self._sent, self._answered = 0, {}
        self._delays: deque[tuple[float, float]] = deque(maxlen=90)
        self._ended = False
        server.on_client_connect(self._add_client)
        server.on_client_disconnect(self._remove_client)

    def count_picture(self) -> None:
        """Counts a picture that was sent."""
        with self._changed:
            self._sent += 1
            self._changed.notify_all()

    def end(self) -> None:
        """Stops asking."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    @property
    def clear(self) -> bool:
        """Whether every browser has received the last picture but one."""
        with self._changed:
            return all(self._sent - number <= 1 for number in self._answered.values())

    def figures(self) -> tuple[int, float]:
        """Returns how many pictures arrived in the last second, and the median delay until then [ms]."""
        now = time.perf_counter()
        with self._changed:
            delays = sorted(1e3 * span for moment, span in self._delays if now - moment < 1.0)
        return len(delays), delays[len(delays) // 2] if delays else 0.0

    def _add_client(self, client: Any) -> None:
        with self._changed:
            self._answered[client.client_id] = self._sent
        threading.Thread(target=self._ask, args=(client,), daemon=True).start()

    def _remove_client(self, client: Any) -> None:
        with self._changed:
            self._answered.pop(client.client_id, None)
            self._changed.notify_all()

    def _ask(self, client: Any) -> None:
        """Asks one question after another; viser has no other that a browser answers in the order of its messages."""
        name = client.client_id
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._ended or self._sent > self._answered.get(name, self._sent), 1.0)
                if self._ended or name not in self._answered:
                    return
                number = self._sent
                if number == self._answered[name]:
                    continue
            began = time.perf_counter()
            try:
                client.local_storage.get_item("hemline", timeout=PATIENCE)
            except Exception:  # the browser left, sleeps or answers nonsense: the others must not wait for it
                pass
            else:
                now = time.perf_counter()
                self._delays.append((now, now - began))
            with self._changed:
                if name in self._answered:
                    self._answered[name] = number
