"""What a fit reached, measured on the frames that it was given."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hemline.arrays import Float

from .frames import Frames
from .linear import LinearMap
from .stage import Stage, projected
from .training_set import Skinned

CHUNK = 256
"""Frames handled at a time where whole frames are needed."""
MOST = 2048
"""Frames of a side that are measured; of more, as many are taken evenly."""
SIDES = ("train", "val", "test")


def fit_figures(frames: Frames, first: Stage, second: Stage, linear: LinearMap) -> dict[str, float]:
    """Mean distances to the ground truth [mm], driven by its bones, by side of the split and stage.

    `*_ridge_mm` is what a straight line from bones to vertices reaches.
    """
    figures = {"skinning_explained_share": first.pca.explained, "shape_explained_share": second.pca.explained}
    perfect = replace(first, coefficients=projected(frames, None, first.pca))
    makers: dict[str, Callable[[np.ndarray], np.ndarray]] = {
        "skinning_basis_mm": lambda some: perfect.rows(some, slice(None)),
        "skinning_mm": lambda some: first.rows(some, slice(None)),
        "error_mm": lambda some: first.rows(some, slice(None)) + second.rows(some, slice(None)),
        "ridge_mm": lambda some: linear.rows(frames, some),
    }
    for side, chosen in zip(SIDES, (frames.train, frames.val, frames.test), strict=True):
        figures[f"{side}_frames"] = float(len(chosen))
        for name, make in makers.items():
            if len(chosen):
                figures[f"{side}_{name}"] = _mean_error_mm(frames, chosen, make)
    return figures


def own_figures(
    frames: Frames, skinned: Skinned, name: str, bones: Float[np.ndarray, "held_out ins"]
) -> dict[str, float]:
    """Mean distances to the ground truth of what own bones make of the held-out sides [mm].

    Args:
        frames: The frames.
        skinned: Both networks.
        name: What the figures are called: `val_<name>_error_mm`.
        bones: Displacements of all bones in the frames of the held-out sides, in their order [m].
    """
    held_out = np.flatnonzero(frames.side > 0)
    figures = {}
    for side, name_of_side in enumerate(SIDES):
        chosen = held_out[frames.side[held_out] == side]
        if side > 0 and len(chosen):
            given = bones[frames.side[held_out] == side]
            where = {int(frame): k for k, frame in enumerate(chosen)}

            def make(some: np.ndarray, given: np.ndarray = given, where: dict[int, int] = where) -> np.ndarray:
                return skinned.rows(given[[where[int(frame)] for frame in some]])

            figures[f"{name_of_side}_{name}_error_mm"] = _mean_error_mm(frames, chosen, make)
    return figures


def _mean_error_mm(frames: Frames, chosen: np.ndarray, make: Callable[[np.ndarray], np.ndarray]) -> float:
    chosen = chosen[:: -(-len(chosen) // MOST)]
    total = 0.0
    for start in range(0, len(chosen), CHUNK):
        some = chosen[start : start + CHUNK]
        left = np.asarray(frames.displacements[some]) - make(some)
        total += float(np.linalg.norm(left.reshape(len(some), -1, 3), axis=2).mean(axis=1).sum())
    return 1e3 * total / len(chosen)
