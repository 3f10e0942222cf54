"""Figures of a fit, measured on its own frames."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hemline.arrays import Float

from .basis_network import BasisNetwork, project_frames
from .frames import KeyFrames
from .linear import LinearMap
from .training_set import MeshNetworks

FRAMES_AT_ONCE = 256
"""Number of frames in memory at a time."""
MAX_MEASURED_FRAMES = 2048
"""Largest number of frames of a side that are measured; more are sampled evenly."""
SIDES = ("train", "val", "test")


def fit_figures(frames: KeyFrames, first: BasisNetwork, second: BasisNetwork, linear: LinearMap) -> dict[str, float]:
    """Returns mean distances to the ground truth, driven by its bones, by side of the split and network [mm].

    `*_ridge_mm` is the error of a linear map from bones to vertices.
    """
    figures = {"skinning_explained_share": first.pca.explained, "shape_explained_share": second.pca.explained}
    perfect = replace(first, coefficients=project_frames(frames, None, first.pca))
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


def figures_of_bones(
    frames: KeyFrames, mesh_networks: MeshNetworks, name: str, bones: Float[np.ndarray, "held_out ins"]
) -> dict[str, float]:
    """Returns the mean error of the networks, driven by given bones, on the validation and test split [mm].

    Args:
        frames: The frames of the takes.
        mesh_networks: Both networks from bones to mesh.
        name: Part of the names of the figures: `val_<name>_error_mm`.
        bones: Displacements of all bones in the frames of the validation and test split, in order [m].
    """
    held_out = np.flatnonzero(frames.side > 0)
    figures = {}
    for side, name_of_side in enumerate(SIDES):
        chosen = held_out[frames.side[held_out] == side]
        if side > 0 and len(chosen):
            given = bones[frames.side[held_out] == side]
            where = {int(frame): k for k, frame in enumerate(chosen)}

            def make(some: np.ndarray, given: np.ndarray = given, where: dict[int, int] = where) -> np.ndarray:
                return mesh_networks.rows(given[[where[int(frame)] for frame in some]])

            figures[f"{name_of_side}_{name}_error_mm"] = _mean_error_mm(frames, chosen, make)
    return figures


def _mean_error_mm(frames: KeyFrames, chosen: np.ndarray, make: Callable[[np.ndarray], np.ndarray]) -> float:
    chosen = chosen[:: -(-len(chosen) // MAX_MEASURED_FRAMES)]
    total = 0.0
    for start in range(0, len(chosen), FRAMES_AT_ONCE):
        some = chosen[start : start + FRAMES_AT_ONCE]
        left = np.asarray(frames.displacements[some]) - make(some)
        total += float(np.linalg.norm(left.reshape(len(some), -1, 3), axis=2).mean(axis=1).sum())
    return 1e3 * total / len(chosen)
