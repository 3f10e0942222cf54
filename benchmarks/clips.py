"""The recordings of ../shared/data/motion, and the most violent stretch of each."""

from pathlib import Path

import numpy as np

from hemline import motions
from hemline.motions.motion import Motion

MOTION = Path(__file__).parents[2] / "shared" / "data" / "motion"


def every_clip() -> list[Path]:
    """All BVH files, by name."""
    return sorted(MOTION.rglob("*.bvh"))


def spread(files: list[Path], count: int) -> list[Path]:
    """So many of the files, evenly over the list."""
    return [files[int(index)] for index in np.linspace(0, len(files) - 1, min(count, len(files)))]


def fastest(file: Path, seconds: float, fps: float = 30.0) -> Motion:
    """The stretch of a recording, without jumps, in which the joints turn most; all of it where it is shorter.

    Args:
        file: The recording.
        seconds: Length of the stretch [s].
        fps: Frames a second of the result.
    """
    motion = motions.read(file)
    first, last = motions.longest_clean(motion)
    motion = motion[first:last].resampled(fps)
    count = min(round(seconds * fps), len(motion))
    turned = np.abs(np.diff(motion.rotations, axis=0)).sum(axis=(1, 2))
    window = np.convolve(turned, np.ones(count - 1), "valid") if count > 1 else np.zeros(1)
    start = int(window.argmax()) if len(window) else 0
    return motion[start : start + count]
