"""Pieces of cloth in one garment, from the skin outwards, each of which is moved outside of those beneath it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import ClosestTree, boundary_loops

from .material import Material
from .pins import Pins

GAP = 0.003
"""Distance between one piece and the next at the start [m]."""

_DEEPEST_OVERLAP = 0.03
"""Cloth that starts at most this deep inside the piece beneath it is moved out; deeper cloth is left alone [m]."""

_ROUNDS = 8


@dataclass(frozen=True)
class Piece:
    """One of several pieces of cloth in a garment; its vertices and faces follow those of the piece beneath."""

    name: str
    vertex_count: int
    """Number of vertices."""
    material: Material
    """Material of the piece."""
    flat_rest: bool
    """Whether the piece is flat when nothing bends it."""

    def as_dict(self) -> dict[str, Any]:
        """Returns the piece as JSON-like values."""
        return {
            "name": self.name,
            "vertex_count": self.vertex_count,
            "material": self.material.as_dict(),
            "flat_rest": self.flat_rest,
        }

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "Piece":
        """Makes the piece that `as_dict` described."""
        return cls(
            str(content["name"]),
            int(content["vertex_count"]),
            Material.of(content["material"]),
            bool(content["flat_rest"]),
        )


def face_pieces(pieces: Sequence[Piece], faces: Faces) -> Int[np.ndarray, " faces"]:
    """Returns the number of the piece that each face belongs to."""
    ends = np.cumsum([piece.vertex_count for piece in pieces])
    return np.searchsorted(ends, faces[:, 0], side="right")


def separate_pieces(vertices: Vertices, faces: Faces, pins: Pins, pieces: Sequence[Piece]) -> tuple[Vertices, Pins]:
    """Moves each piece of a garment, with its pins, outside of those beneath it.

    Args:
        vertices: Start positions [m].
        faces: Triangles, piece by piece.
        pins: The garment's pins. Those on the skin are raised, those on joints moved.
        pieces: The pieces, from the skin outwards.

    Returns:
        Vertices, float32 [m], and pins.
    """
    moved = np.array(vertices, np.float64)
    bounds = np.cumsum([0, *(piece.vertex_count for piece in pieces)])
    owner = face_pieces(pieces, faces)
    for outer in range(1, len(pieces)):
        own = slice(bounds[outer], bounds[outer + 1])
        for _ in range(_ROUNDS):
            before = moved[own].copy()
            for inner in range(outer):
                low, high = bounds[inner], bounds[inner + 1]
                moved[own] = _outside(moved[own], moved[low:high], faces[owner == inner] - low)
            if np.array_equal(before, moved[own]):
                break
    displacement = (moved - vertices)[pins.vertices]
    on_skin = pins.joints < 0
    raised = np.where(on_skin, np.linalg.norm(displacement, axis=1), 0.0)
    offsets = pins.offsets + np.where(on_skin[:, None], 0.0, displacement)
    raised_pins = replace(pins, heights=(pins.heights + raised).astype(np.float32), offsets=offsets.astype(np.float32))
    return moved.astype(np.float32), raised_pins


def _outside(vertices: np.ndarray, inner: Vertices, faces: Faces) -> np.ndarray:
    """Moves vertices behind an open surface, or too close in front of it, to the gap; not those beyond its rim."""
    tree = ClosestTree(np.asarray(inner, np.float64), faces)
    closest, result = tree.closest(vertices), vertices.copy()
    outward = tree.outward(closest)
    height = ((vertices - closest.positions) * outward).sum(axis=1)
    on_rim = np.zeros(len(inner), bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    beyond = (on_rim[faces[closest.faces]] | (closest.weights <= 0)).all(axis=1)
    near = (closest.distances < _DEEPEST_OVERLAP) & ~beyond & (height < GAP - 1e-6)
    result[near] = (closest.positions + 1.0001 * GAP * outward)[near]
    return result
