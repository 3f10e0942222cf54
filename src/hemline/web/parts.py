"""What a page holds of one model, and how arrays are laid out for it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.arrays import Int, Vertices
from hemline.learning.packed_basis import PackedBasis


@dataclass(frozen=True)
class PagePart:
    """One model in a page.

    Attributes:
        arrays: By name.
        metadata: What is no array; `animator` says which of the page's animators plays it.
    """

    arrays: Mapping[str, np.ndarray]
    metadata: Mapping[str, Any]


def short_numbers(vertices: Int[np.ndarray, "rows corners"], vertex_count: int) -> np.ndarray:
    """Corners of triangles, ends of edges, in as few bytes as hold the number of vertices."""
    return vertices.astype(np.uint16 if vertex_count <= 65536 else np.uint32)


def basis_arrays(basis: PackedBasis, name: str) -> dict[str, np.ndarray]:
    """A packed basis; digits as `differences`, which zip to half of what digits do."""
    arrays = {"digits": differences(basis.digits), "scales": basis.scales, "modes": basis.modes}
    return {f"{name}.{key}": array for key, array in arrays.items()}


def differences(digits: Int[np.ndarray, "rows columns"]) -> Int[np.ndarray, "columns 3 verts"]:
    """Digits less those of the vertex before, modulo 256, by column and coordinate: no digit is lost."""
    by_column = digits.T.reshape(digits.shape[1], -1, 3).transpose(0, 2, 1)
    return np.diff(by_column, axis=2, prepend=np.int8(0)).astype(np.int8)


def nearest_skin(vertices: Vertices, skin: Vertices) -> Int[np.ndarray, " verts"]:
    """Vertex of the body nearest to each of a garment's at rest: where the page's push begins to seek."""
    from scipy.spatial import KDTree

    return np.asarray(KDTree(skin).query(vertices)[1], np.int32)
