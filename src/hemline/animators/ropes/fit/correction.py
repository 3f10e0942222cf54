"""Fit of the linear correction of the ropes' bones towards those of the simulation."""

from collections.abc import Sequence

import numpy as np

from hemline.animators.ropes.bones.body_inputs import REST_INPUTS
from hemline.animators.ropes.bones.bone_correction import BoneCorrection
from hemline.arrays import Float
from hemline.learning.pca import principal_of_map
from hemline.learning.ridge import ridge_through_zero

from .frames import KeyFrames

NOISE = (0.4, 0.1, 0.2, 0.8, 1.6)
"""Noise on the inputs that is tried, relative to the deviation of each; the first is used without validation data."""
SMALLEST_DEVIATION = 1e-3
"""Smallest deviation of an input, for inputs that hardly vary."""


def fit_correction(frames: KeyFrames, components: int, noises: Sequence[float] = NOISE) -> BoneCorrection:
    """Fits the ridge regression from the ropes' bones and the motion of the body to the error of these bones.

    It has no constant, so that it is zero at rest. The noise of the regression is the one with the least mean distance
    on validation data.

    Args:
        frames: Bones of the simulation and of the ropes, the motion of the body, and the split.
        components: Number of principal directions of the inputs, and of the outputs.
        noises: Noise on the inputs that is tried, relative to the deviation of each.

    Raises:
        BadDataset: No bone moves.
    """
    train, rows = frames.train, len(frames.free)
    nothing = np.zeros(rows)
    modes = principal_of_map(np.eye(rows), nothing, frames.bones[train] * frames.free, components).basis
    modes = (modes * frames.free).astype(np.float32)
    missing = (frames.bones - frames.rope_bones) * frames.free
    body = frames.body[train]
    inputs = np.concatenate([frames.rope_bones[train] @ modes.T, body - REST_INPUTS], axis=1)
    deviations = np.maximum(inputs.std(axis=0), SMALLEST_DEVIATION)
    low, high = body.min(axis=0).astype(np.float32), body.max(axis=0).astype(np.float32)
    best, least = None, np.inf
    for noise in noises if len(frames.val) else noises[:1]:
        whole = ridge_through_zero(inputs, missing[train], noise * deviations)
        outputs = principal_of_map(whole, nothing, inputs, components).basis * frames.free
        matrix = np.ascontiguousarray(outputs @ whole, np.float32)
        found = BoneCorrection(modes, matrix, outputs.astype(np.float32), low, high)
        error = bone_error_m(frames, missing, found) if len(frames.val) else 0.0
        if error < least:
            best, least = found, error
    assert best is not None
    return best


def bone_error_m(frames: KeyFrames, missing: Float[np.ndarray, "frames ins"], correction: BoneCorrection) -> float:
    """Returns the mean distance of corrected bones to simulated ones on validation data [m]."""
    left = missing[frames.val] - correction(frames.rope_bones[frames.val], frames.body[frames.val])
    return float(np.linalg.norm(left.reshape(len(left), -1, 3), axis=2).mean())


def worst_correction(frames: KeyFrames, played: Float[np.ndarray, "held_out ins"]) -> float:
    """Returns the largest mean distance of corrected bones in a validation take, as a ratio to that of the ropes.

    Up to 1 the correction improves each of these takes.

    Args:
        frames: Bones of the simulation and of the ropes, and the split.
        played: Displacements of all bones in the frames of the validation and test split, in order [m].
    """
    held_out, ratios = np.flatnonzero(frames.side > 0), []
    for take in np.unique(frames.take[frames.val]):
        some = frames.take[held_out] == take
        truth, ropes = (each[held_out[some]] * frames.free for each in (frames.bones, frames.rope_bones))
        before, after = (
            np.linalg.norm((truth - each).reshape(-1, 3), axis=1).mean() for each in (ropes, played[some] * frames.free)
        )
        ratios.append(float(after / max(before, 1e-9)))
    return max(ratios)
