"""Finds who was captured, as far as a clip's name tells."""

import re
from pathlib import Path

from .motion import Motion
from .shipped import load, names

_CMU = re.compile(r"(?<![A-Za-z0-9])\d{2,3}_\d{2}(?![0-9])")
_CHANGED = re.compile(r"( looped)?( x[0-9.]+)?$")
"""What `Motion.at_speed` and `models.make.runs` add to a name."""
_COUPLES = {"19": "18", "21": "20", "23": "22", "34": "33", "61": "60"}


def cmu_number(text: str) -> str | None:
    """Returns the number of the CMU recording that a text names, such as `02_03`."""
    match = _CMU.search(text)
    return match.group() if match else None


def subject_of(clip: Motion | str | Path) -> str:
    """Returns who was captured: the subject's number of CMU recordings, else the name without its trailing number.

    Couples that were recorded together count as one, under the lower number.

    Args:
        clip: A motion, the name of a shipped one, or a file's name.
    """
    if not isinstance(clip, Motion) and str(clip) in names():
        clip = load(str(clip))
    name, source = (clip.name, clip.source) if isinstance(clip, Motion) else (Path(clip).stem, Path(clip).stem)
    number = cmu_number(source)
    if number is None:
        recorded = _CHANGED.sub("", name)
        return re.sub(r"[_ -]*\d+$", "", recorded) or recorded
    subject = number.partition("_")[0]
    return _COUPLES.get(subject, subject)
