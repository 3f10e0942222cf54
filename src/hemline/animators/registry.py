"""Animators by name: those of this package, and those that others register as entry points of `hemline.animators`."""

import difflib
import functools
from importlib.metadata import entry_points

from hemline.errors import BadInput

from .base import AnimatorKind
from .lazy_kind import import_object

GROUP = "hemline.animators"
"""Name of the entry point group."""
OURS = {
    "agentdress": "hemline.animators.agentdress.kind:KIND",
    "lag": "hemline.animators.lag:KIND",
    "live": "hemline.animators.live:KIND",
    "ropes": "hemline.animators.ropes:KIND",
    "skinned": "hemline.animators.skinned:KIND",
    "swingar": "hemline.animators.swingar:KIND",
}
"""Where this package defines its animators. An entry point of the same name does not replace them."""


@functools.cache
def _places() -> dict[str, str]:
    return {point.name: point.value for point in entry_points(group=GROUP)} | OURS


def animator_names() -> list[str]:
    """Returns the names of all installed animators, sorted."""
    return sorted(_places())


def animator_kind(name: str, *, error: type[BadInput] = BadInput) -> AnimatorKind:
    """Returns the kind of an animator: its options, its fit and its model files. Its module is imported by this call.

    Args:
        name: Name of the animator in model files and on the command line.
        error: Class of the exception to raise.

    Raises:
        error: No such animator is installed.
    """
    places = _places()
    if not isinstance(name, str) or name not in places:
        near = difflib.get_close_matches(str(name), places, 1)
        hint = f"did you mean '{near[0]}'?" if near else "install the package that brings it"
        raise error("no such animator", repr(name), f"installed: {', '.join(animator_names())}; {hint}")
    return import_object(places[name])
