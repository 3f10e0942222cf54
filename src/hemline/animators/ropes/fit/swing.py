"""How much more simulated bones swing than those that are played."""

from dataclasses import replace

import numpy as np

from hemline.animators.ropes.bones.bone_correction import MOST_GAIN, BoneCorrection
from hemline.animators.ropes.bones.bone_source import SWING_SECONDS, BoneSource
from hemline.animators.ropes.bones.bones import bones_of_mesh, rest_bones
from hemline.arrays import Float
from hemline.learning.key_frame import to_key_frame

from .gather import TakeFrames

MAX_TAKES = 24
"""Largest number of takes that are played."""


def with_swing_gain(source: TakeFrames, bones: BoneSource) -> BoneCorrection:
    r"""Returns the correction of the bones with the gain that gives played bones the swing of simulated ones.

    $$g^2 = \sum \lVert d^* - \bar d^* \rVert^2 \, / \, \sum \lVert d - \bar d \rVert^2$$

    with $d$ the displacements of the free bones in playing takes to train on, $d^*$ those in the simulation, and the
    bar their mean over the last `SWING_SECONDS`. The gain is limited to 1 to `MOST_GAIN`.

    Args:
        source: The takes.
        bones: The bones as they play, with a gain of 1.
    """
    rows = [index for index, side in enumerate(source.sides) if side == 0]
    chosen = np.unique(np.linspace(0, len(rows) - 1, min(MAX_TAKES, len(rows))).astype(int))
    ours, theirs = 0.0, 0.0
    for index in (rows[k] for k in chosen):
        played, simulated = _swing_of_take(source, bones, index)
        ours, theirs = ours + float((played**2).sum()), theirs + float((simulated**2).sum())
    gain = np.sqrt(theirs / ours) if ours > 0 else 1.0
    return replace(bones.correction, swing_gain=float(np.clip(gain, 1, MOST_GAIN)))


def _swing_of_take(
    source: TakeFrames, bones: BoneSource, index: int
) -> tuple[Float[np.ndarray, "frames free"], Float[np.ndarray, "frames free"]]:
    """Returns the swing of the free bones in one take without its lead-in, as played and as simulated [m]."""
    row, ropes = source.rows[index], bones.ropes
    take, shape = source.dataset.take(row), source.shape_of(row)
    shaped, free = source.shaped[shape], np.repeat(ropes.parents >= 0, 3)
    rest = rest_bones(ropes, source.rests[shape], shaped)
    state, dt = bones.start(shaped.posed(take.motion[0])), 1 / take.motion.fps
    share, mean = -np.expm1(-dt / SWING_SECONDS), np.zeros(3 * ropes.node_count)
    played, simulated = [], []
    for frame in range(len(take.motion)):
        posed = shaped.posed(take.motion[frame])
        state, moved = bones.step(state, posed, dt, rest)
        key = posed.transforms[ropes.key_index].astype(np.float64)
        truth = (to_key_frame(key, bones_of_mesh(ropes, take.vertices[frame], posed)) - rest).reshape(-1)
        mean = mean + share * (truth - mean)
        played.append((moved - state.mean)[free])
        simulated.append((truth - mean)[free])
    return np.array(played)[take.clip_frames], np.array(simulated)[take.clip_frames]
