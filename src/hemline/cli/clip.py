"""Cuts a clip to the time range that a command asks for."""

from typing import Literal

from hemline.errors import BadInput
from hemline.motions import Motion

Up = Literal["x", "y", "z", "-x", "-y", "-z"]
"""Axis that is up in the file of a clip."""


def cut(motion: Motion, start: float, seconds: float | None) -> Motion:
    """Returns the part of a clip from `start`, at most `seconds` long.

    Args:
        motion: The clip.
        start: Start time [s].
        seconds: Length [s]; None for the rest of the clip.

    Raises:
        BadInput: The start is negative or past the end of the clip, or the length is not positive.
    """
    if not 0 <= start <= motion.seconds:
        raise BadInput(
            "--start must lie within the clip", f"{start:g} s of {motion.seconds:.3g} s", "leave it out for 0"
        )
    if seconds is not None and not seconds > 0:
        raise BadInput("--seconds must be positive", seconds, "leave it out for the whole clip")
    first = round(start * motion.fps)
    last = len(motion) if seconds is None else first + max(2, round(seconds * motion.fps) + 1)
    return motion[first:last]
