"""How much more simulated bones swing than those that are played."""

from dataclasses import replace

import numpy as np

from hemline.animators.ropes.bones.bone_correction import MOST_GAIN, BoneCorrection
from hemline.animators.ropes.bones.bone_source import SWING_SECONDS, BoneSource
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.arrays import Float
from hemline.learning.key_frame import to_key_frame

from .gather import TakeFrames
from .play import play_take

MAX_TAKES = 24
"""Largest number of takes that are played."""


def with_swing_gain(source: TakeFrames, bones: BoneSource) -> BoneCorrection:
    r"""Returns the correction of the bones with the gain that gives played bones the swing of simulated ones.

    $$\sum \lVert H d + (g - 1) H^2 d \rVert^2 = \sum \lVert H d^* \rVert^2$$

    with $d$ the displacements of the free bones in playing takes to train on, $d^*$ those in the simulation, and $H$
    their deviation from the mean over the last `SWING_SECONDS`. The gain is limited to 1 to `MOST_GAIN`.

    Args:
        source: The takes.
        bones: The bones as they play, with a gain of 1.
    """
    rows = [index for index, side in enumerate(source.sides) if side == 0]
    chosen = np.unique(np.linspace(0, len(rows) - 1, min(MAX_TAKES, len(rows))).astype(int))
    square, product, missing = 0.0, 0.0, 0.0
    for index in (rows[k] for k in chosen):
        once, twice, simulated = _swing_of_take(source, bones, index)
        square, product = square + float((twice**2).sum()), product + float((once * twice).sum())
        missing += float((simulated**2).sum() - (once**2).sum())
    more = (np.sqrt(product**2 + square * missing) - product) / square if missing > 0 and square > 0 else 0.0
    return replace(bones.correction, swing_gain=float(min(1 + more, MOST_GAIN)))


def _swing_of_take(source: TakeFrames, bones: BoneSource, index: int) -> tuple[Float[np.ndarray, "frames free"], ...]:
    """Returns the swing of the free bones in one take without its lead-in [m].

    Returns:
        The swing as played, the swing of that swing, and the swing in the simulation.
    """
    row, ropes = source.rows[index], bones.ropes
    take, shape = source.dataset.take(row), source.shape_of(row)
    shaped, free = source.shaped[shape], np.repeat(ropes.parents >= 0, 3)
    rest, dt = rest_bones(ropes, source.rests[shape], shaped), 1 / take.motion.fps
    transforms, _ = shaped.transforms_of(take.motion.rotations, take.motion.translations)
    keys = transforms[:, ropes.key_index].astype(np.float64)
    simulated = np.stack(
        [to_key_frame(key, each) - rest for key, each in zip(keys, ropes.positions_on(take.vertices), strict=True)]
    )
    once = _swing(play_take(source, bones, take, shape)[:, free], dt)
    every = once, _swing(once, dt), _swing(simulated.reshape(len(keys), -1)[:, free], dt)
    return tuple(each[take.clip_frames] for each in every)


def _swing(displacements: Float[np.ndarray, "frames free"], dt: float) -> Float[np.ndarray, "frames free"]:
    """Returns the deviation of displacements from their slow mean, frame by frame [m]."""
    share, mean, found = -np.expm1(-dt / SWING_SECONDS), np.zeros(displacements[0].shape), []
    for each in displacements:
        mean = mean + share * (each - mean)
        found.append(each - mean)
    return np.array(found)
