"""What the hands on the page ask for, from any thread, until the one that plays has time for it."""

import threading
from typing import Any


class Requests:
    """The latest wish of each name: a slider that is dragged asks for its last place only."""

    def __init__(self) -> None:
        self._held: dict[str, Any] = {}
        self._any = threading.Condition()

    def put(self, name: str, value: Any = None) -> None:
        """Wish for something; an older wish of this name is dropped."""
        with self._any:
            self._held.pop(name, None)
            self._held[name] = value
            self._any.notify_all()

    def taken(self, seconds: float = 0.0) -> dict[str, Any]:
        """All wishes in their order, which are then fulfilled.

        Args:
            seconds: How long to wait for the first one.
        """
        with self._any:
            self._any.wait_for(lambda: bool(self._held), seconds)
            held, self._held = self._held, {}
            return held
