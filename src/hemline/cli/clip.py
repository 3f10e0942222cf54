"""The part of a clip that a command is asked for."""

from hemline.errors import BadInput
from hemline.motions import Motion


def cut(motion: Motion, start: float, seconds: float | None) -> Motion:
    """The clip from `start` on, `seconds` long at most.

    Args:
        motion: The clip.
        start: Where it begins [s].
        seconds: How much of it; None: all that is left [s].

    Raises:
        BadInput: A start that is negative or past the end, a length that is not positive.
    """
    if not 0 <= start < motion.seconds:
        raise BadInput(
            "--start must lie within the clip", f"{start:g} s of {motion.seconds:.3g} s", "leave it out for 0"
        )
    if seconds is not None and not seconds > 0:
        raise BadInput("--seconds must be positive", seconds, "leave it out for the whole clip")
    first = round(start * motion.fps)
    last = len(motion) if seconds is None else first + max(2, round(seconds * motion.fps) + 1)
    return motion[first:last]
