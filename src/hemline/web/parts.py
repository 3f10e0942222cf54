"""One model in a page, and the layout of its arrays."""

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
        arrays: Arrays by name.
        metadata: All other data; `animator` names the animator of the page that plays it.
    """

    arrays: Mapping[str, np.ndarray]
    metadata: Mapping[str, Any]


def short_numbers(vertices: Int[np.ndarray, "rows corners"], vertex_count: int) -> np.ndarray:
    """Returns indices of vertices in as few bytes as possible."""
    return vertices.astype(np.uint16 if vertex_count <= 65536 else np.uint32)


def basis_arrays(basis: PackedBasis, name: str) -> dict[str, np.ndarray]:
    """Returns the arrays of a packed basis, with its digits as `differences`, which compress to half the size."""
    arrays = {"digits": differences(basis.digits), "scales": basis.scales, "modes": basis.modes}
    return {f"{name}.{key}": array for key, array in arrays.items()}


def differences(digits: Int[np.ndarray, "rows columns"]) -> Int[np.ndarray, "columns 3 verts"]:
    """Returns digits minus those of the previous vertex, modulo 256, by column and coordinate, without loss."""
    by_column = digits.T.reshape(digits.shape[1], -1, 3).transpose(0, 2, 1)
    return np.diff(by_column, axis=2, prepend=np.int8(0)).astype(np.int8)


def nearest_skin(vertices: Vertices, skin: Vertices) -> Int[np.ndarray, " verts"]:
    """Returns the vertex of the body nearest to each vertex of a garment at rest, where the push of the page starts."""
    from scipy.spatial import KDTree

    return np.asarray(KDTree(skin).query(vertices)[1], np.int32)
