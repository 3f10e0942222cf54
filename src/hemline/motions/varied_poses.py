"""Poses of many people that ship with the package: what a garment should be settled in before it is fitted."""

import functools
from pathlib import Path

from .motion import Motion
from .store import read_many

SHIPPED_POSES = Path(__file__).parents[1] / "models" / "poses.safetensors"
"""File of the poses, made by `python -m hemline.models.make.varied_poses FOLDER`."""
POSES_FPS = 7.5
"""Frame rate of the clip that holds them: poses for garments are taken from clips at this rate [frames/s]."""


@functools.cache
def varied_poses() -> Motion:
    """Returns poses of many people as the frames of a clip, each unrelated to the one before.

    They represent the clusters of recordings of people other than those of the shipped clips.
    """
    return read_many(SHIPPED_POSES)["poses"]
