"""What a reader of foreign mesh files returns."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int


@dataclass(frozen=True)
class ReadMesh:
    """A triangle mesh as a file holds it: vertex ids and order untouched, unit as in the file."""

    vertices: Float[np.ndarray, "verts 3"]
    """Positions, float64, in the unit of the file."""
    faces: Int[np.ndarray, "faces 3"]
    """Triangles, int32, counted from 0."""
    pattern: Float[np.ndarray, "pattern_verts 2"] | None = None
    """Texture coordinates (`vt`), float64, as in the file; None where there are none."""
    pattern_faces: Int[np.ndarray, "faces 3"] | None = None
    """For each corner of `faces` its row in `pattern`; None where `pattern` is."""
    notes: tuple[str, ...] = ()
    """What the reader did on its own, in words."""
