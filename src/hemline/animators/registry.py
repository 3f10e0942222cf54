"""Animators by name: ours, and those that other packages register under the entry point `hemline.animators`."""

import difflib
import functools
import importlib
from importlib.metadata import entry_points

from hemline.errors import BadInput

from .base import AnimatorKind

GROUP = "hemline.animators"
OURS = {
    "agentdress": "hemline.animators.agentdress.kind:KIND",
    "lag": "hemline.animators.lag:KIND",
    "live": "hemline.animators.live:KIND",
    "ropes": "hemline.animators.ropes:KIND",
    "swingar": "hemline.animators.swingar:KIND",
}
"""Where the kinds of this package are; no entry point replaces one."""


@functools.cache
def _places() -> dict[str, str]:
    return {point.name: point.value for point in entry_points(group=GROUP)} | OURS


def animator_names() -> list[str]:
    """Names of all animators that are installed."""
    return sorted(_places())


def animator_kind(name: str, *, error: type[BadInput] = BadInput) -> AnimatorKind:
    """How an animator is fitted and read back; its module is imported now, not before.

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
