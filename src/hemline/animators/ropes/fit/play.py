"""Bones as they play along the takes of a fit."""

import numpy as np

from hemline.animators.ropes.bones.bone_source import BoneSource
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.arrays import Float
from hemline.datasets import Take

from .gather import TakeFrames


def play_take(source: TakeFrames, bones: BoneSource, take: Take, shape: int) -> Float[np.ndarray, "frames ins"]:
    """Returns displacements of all bones in playing one take, lead-in included [m].

    Args:
        source: The takes.
        bones: The bones.
        take: The take.
        shape: Index of its body shape.
    """
    shaped = source.shaped[shape]
    rest = rest_bones(bones.ropes, source.rests[shape], shaped)
    state, moved = bones.start(shaped.posed(take.motion[0])), []
    for index in range(len(take.motion)):
        state, each = bones.step(state, shaped.posed(take.motion[index]), 1 / take.motion.fps, rest)
        moved.append(each)
    return np.stack(moved)


def play_held_out(source: TakeFrames, bones: BoneSource) -> Float[np.ndarray, "held_out ins"]:
    """Returns displacements of all bones in playing the held-out takes, one after the other without lead-ins [m]."""
    displacements = [np.zeros((0, 3 * bones.ropes.node_count), np.float32)]
    for take, side, shape in source.takes():
        if side:
            displacements.append(play_take(source, bones, take, shape)[take.clip_frames])
    return np.concatenate(displacements)
