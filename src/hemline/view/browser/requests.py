"""Requests of browsers: collected from any thread, kept until the loop of the page has time for them."""

import threading
from enum import StrEnum
from typing import Any


class Request(StrEnum):
    """Everything that a browser can ask the page for; `Page.HANDLERS` says what is done about it."""

    PLAY_OR_PAUSE = "play_or_pause"
    FRAME = "frame"
    SPEED = "speed"
    MODEL = "model"
    CLIP = "clip"
    MATERIAL = "material"
    BETAS = "betas"
    WIND = "wind"
    GRAB = "grab"
    DRAG = "drag"
    RESET_DRAG = "reset_drag"
    MEASURE = "measure"
    WORST = "worst"
    SAVE = "save"
    SHOWN = "shown"
    PAINT = "paint"
    MARK = "mark"
    BODY = "body"
    FOLLOW = "follow"
    BONES = "bones"
    COLLIDERS = "colliders"
    HANDLE = "handle"


class Requests:
    """The latest request of each kind: of a slider that is dragged, only the last position counts."""

    def __init__(self) -> None:
        self._pending: dict[Request, Any] = {}
        self._changed = threading.Condition()

    def put(self, request: Request, value: Any = None) -> None:
        """Adds a request and drops an older one of the same kind."""
        with self._changed:
            self._pending.pop(request, None)
            self._pending[request] = value
            self._changed.notify_all()

    def is_pending(self, request: Request) -> bool:
        """Whether a request of this kind waits to be taken."""
        with self._changed:
            return request in self._pending

    def take(self, seconds: float = 0.0) -> dict[Request, Any]:
        """Removes all requests and returns them in their order.

        Args:
            seconds: How long to wait for the first one [s].
        """
        with self._changed:
            self._changed.wait_for(lambda: bool(self._pending), seconds)
            taken, self._pending = self._pending, {}
            return taken
