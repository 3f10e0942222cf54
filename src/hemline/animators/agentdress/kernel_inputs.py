"""Named tuples that the kernels of AgentDress take: the garment's tables, the rigged anchors."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int


class GarmentTables(NamedTuple):
    """What `tables.Tables` says of each vertex of a garment."""

    indices: Int[np.ndarray, "verts influences"]
    """Bones of each vertex, the heaviest first."""
    weights: Float[np.ndarray, "verts influences"]
    """Weights of these bones [1]."""
    regions: Float[np.ndarray, "verts regions"]
    """Weight of each region at each vertex [1]."""
    digits: Int[np.ndarray, "verts 3 columns"]
    """The basis, int8."""


class AnchorTables(NamedTuple):
    """Rigged anchors as `sor.rigged_tables.RiggedTables` stores them."""

    transforms: Float[np.ndarray, "anchors joints 3 4"]
    """Skin transforms of the anchors."""
    vertices: Int[np.ndarray, "anchors verts 3"]
    """Garments of the anchors, in steps, int16."""
    step: float
    """Size of a step [m]."""
    indices: Int[np.ndarray, "anchors verts bones"]
    """Bones of each vertex, the heaviest first, uint8."""
    weights: Int[np.ndarray, "anchors verts bones"]
    """Weights of these bones, uint8; a row sums to 255."""
