"""A garment at rest as the network is given it."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Faces, Float

from .graph import Graph


@dataclass(frozen=True, eq=False)
class GarmentSample:
    """A garment at rest on one body."""

    graph: Graph
    """Graph of the garment."""
    faces: Faces
    """Triangles of the garment."""
    features: Float[np.ndarray, "verts 7"]
    """Normal, position [m], signed distance to the body [m] of each vertex, float32."""
    descriptor: Float[np.ndarray, " descriptor"]
    """Eigenvalues [1], float32."""
    skin_logits: Float[np.ndarray, "verts joints"]
    """Logits of the skin weights, float32."""
    mass: Float[np.ndarray, " verts"]
    """Mass of each vertex [kg], float32."""
