"""The triangles of a primitive of a glTF file."""

from typing import Any

import numpy as np

from hemline.arrays import Int

from .gltf import Gltf

PRIMITIVES_MAX = 10_000
"""Largest number of primitives read from a file, each counted as often as a node shows it."""


def triangles(gltf: Gltf, primitive: dict[str, Any]) -> Int[np.ndarray, "faces 3"]:
    """Returns the triangles of a primitive, as rows of its attributes; none if it draws points or lines.

    Args:
        gltf: The file.
        primitive: Entry of a mesh in the document.

    Raises:
        BadInput: (as `gltf.error`) A corner is no vertex, or see `Gltf.array`.
    """
    with gltf.readable():
        count = len(gltf.array(primitive["attributes"]["POSITION"]))
        corners = np.arange(count)
        if "indices" in primitive:
            corners = gltf.array(primitive["indices"])
            if corners.ndim != 1 or corners.dtype.kind != "u":
                raise ValueError("indices")
        faces = _faces(corners.astype(np.int64), primitive.get("mode", 4))
        if faces.size and faces.max() >= count:
            raise ValueError("indices")
        return faces


def _faces(corners: np.ndarray, mode: int) -> np.ndarray:
    """Returns the triangles of a list, a strip or a fan."""
    if mode == 4:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    if mode in (5, 6) and len(corners) >= 3:
        first = corners[:-2] if mode == 5 else np.full(len(corners) - 2, corners[0])
        faces = np.stack([first, corners[1:-1], corners[2:]], 1)
        if mode == 5:
            faces[1::2] = faces[1::2][:, [1, 0, 2]]
        return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
    return np.zeros((0, 3), np.int64)
