"""Animators by name: ours, and those that other packages register under the entry point `hemline.animators`."""

import difflib
import functools
import importlib
from importlib.metadata import entry_points
from typing import Any

from hemline.errors import BadInput

GROUP = "hemline.animators"
_OURS = {"ropes": "hemline.animators.ropes:AnimatorRopes"}


@functools.cache
def _places() -> dict[str, str]:
    return {point.name: point.value for point in entry_points(group=GROUP)} | _OURS


def animator_names() -> list[str]:
    """Names of all animators that are installed."""
    return sorted(_places())


def animator_class(name: str, *, error: type[BadInput] = BadInput) -> Any:
    """The class of an animator; its module is imported now, not before.

    Args:
        name: Its name in model files and on the command line.
        error: The class to raise.

    Raises:
        error: No such animator is installed.
    """
    places = _places()
    if not isinstance(name, str) or name not in places:
        near = difflib.get_close_matches(str(name), places, 1)
        hint = f"did you mean '{near[0]}'?" if near else "install the package that brings it"
        raise error("no such animator", repr(name), f"installed: {', '.join(animator_names())}; {hint}")
    module, _, attribute = places[name].partition(":")
    return getattr(importlib.import_module(module), attribute)


def name_of(animator: Any) -> str:
    """The name under which an animator's class is installed; the class's own where it is not."""
    found = (name for name in animator_names() if animator_class(name) is type(animator))
    return next(found, type(animator).__name__)
