"""How fast the browsers are: none is sent a picture before it has taken up the last one but one.

Without it, a browser that paints slower than frames are made would be further behind with each of them.
"""

import threading
import time
from collections import deque
from typing import Any

PATIENCE = 2.0
"""A browser that does not answer for so long is waited for no more [s]: a tab that sleeps, a cable that was pulled."""


class FrameThrottle:
    """Asks each browser after each picture, and hears when it has come there.

    Args:
        server: The viser server.
    """

    def __init__(self, server: Any):
        self._heard = threading.Condition()
        self._sent, self._answered = 0, {}
        self._moments: deque[tuple[float, float]] = deque(maxlen=90)
        self._ended = False
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._left)

    def sent(self) -> None:
        """A picture was sent."""
        with self._heard:
            self._sent += 1
            self._heard.notify_all()

    def end(self) -> None:
        """Ask no more."""
        with self._heard:
            self._ended = True
            self._heard.notify_all()

    @property
    def clear(self) -> bool:
        """Whether all browsers have taken up the last picture but one."""
        with self._heard:
            return all(self._sent - number <= 1 for number in self._answered.values())

    def figures(self) -> tuple[int, float]:
        """Pictures that came to browsers in the last second, and the median time until they were there [ms]."""
        now = time.perf_counter()
        with self._heard:
            late = sorted(1e3 * span for moment, span in self._moments if now - moment < 1.0)
        return len(late), late[len(late) // 2] if late else 0.0

    def _came(self, client: Any) -> None:
        with self._heard:
            self._answered[client.client_id] = self._sent
        threading.Thread(target=self._ask, args=(client,), daemon=True).start()

    def _left(self, client: Any) -> None:
        with self._heard:
            self._answered.pop(client.client_id, None)
            self._heard.notify_all()

    def _ask(self, client: Any) -> None:
        """One question after the other; viser has no other that a browser answers in the order of its messages."""
        name = client.client_id
        while True:
            with self._heard:
                self._heard.wait_for(lambda: self._ended or self._sent > self._answered.get(name, self._sent), 1.0)
                if self._ended or name not in self._answered:
                    return
                number = self._sent
                if number == self._answered[name]:
                    continue
            asked = time.perf_counter()
            try:
                client.local_storage.get_item("hemline", timeout=PATIENCE)
            except Exception:  # it left, sleeps, or answers what it was not asked: the others are not to wait for it
                pass
            else:
                now = time.perf_counter()
                self._moments.append((now, now - asked))
            with self._heard:
                if name in self._answered:
                    self._answered[name] = number
