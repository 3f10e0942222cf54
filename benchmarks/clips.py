"""Recordings of ../shared/data/motion, and the most violent section of each."""

from pathlib import Path

import numpy as np

from hemline import motions
from hemline.motions.motion import Motion

MOTION = Path(__file__).parents[2] / "shared" / "data" / "motion"


def all_clips() -> list[Path]:
    """Returns all BVH files, by name."""
    return sorted(MOTION.rglob("*.bvh"))


def select_evenly(files: list[Path], count: int) -> list[Path]:
    """Returns `count` of the files, evenly spaced over the list."""
    return [files[int(index)] for index in np.linspace(0, len(files) - 1, min(count, len(files)))]


def fastest_section(file: Path, seconds: float, fps: float = 30.0) -> Motion:
    """Returns the section of a recording, without jumps, in which the joints rotate most.

    Args:
        file: The recording.
        seconds: Length of the section [s]; shorter recordings are returned whole.
        fps: Frame rate of the result [frames/s].
    """
    motion = motions.read(file)
    first, last = motions.longest_clean(motion)
    motion = motion[first:last].resample(fps)
    count = min(round(seconds * fps), len(motion))
    turned = np.abs(np.diff(motion.rotations, axis=0)).sum(axis=(1, 2))
    window = np.convolve(turned, np.ones(count - 1), "valid") if count > 1 else np.zeros(1)
    start = int(window.argmax()) if len(window) else 0
    return motion[start : start + count]
