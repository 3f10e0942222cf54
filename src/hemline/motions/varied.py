"""Poses and short sections of recordings of many people: what a garment should be simulated in before it is fitted."""

import functools
from pathlib import Path

from .motion import Motion
from .store import read_many

VARIED = Path(__file__).parents[1] / "models" / "varied.safetensors"
"""File of the poses and sections, made by `python -m hemline.models.make.varied FOLDER`."""
POSES = "poses"
"""Name of the clip in it that holds the poses."""
POSES_FPS = 7.5
"""Frame rate of that clip: poses for garments are taken from clips at this rate [frames/s]."""


@functools.cache
def _varied() -> dict[str, Motion]:
    return read_many(VARIED)


def varied_poses() -> Motion:
    """Returns poses of many people as the frames of a clip, each unrelated to the one before.

    They represent the clusters of recordings of people other than those of the shipped clips (but for `turn`).
    """
    return _varied()[POSES]


def varied_clips() -> tuple[Motion, ...]:
    """Returns short sections of these recordings, by name."""
    return tuple(motion for name, motion in _varied().items() if name != POSES)
