"""The same garment of fewer vertices, for a garment that is far from the camera."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Int
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.garments.pins import Pins
from hemline.meshes import coarser

LEAST = 50
"""Vertices that a garment has at least."""


def coarser_garment(garment: Garment, share: float) -> tuple[Garment, Int[np.ndarray, " kept"]]:
    """A garment whose vertices are some of another one's; cut, pins, pieces and material stay.

    Rims and pinned lines stay where they are. Chains by hand are left out: they lie on the full garment.

    Args:
        garment: The full one.
        share: How many of its vertices to keep, above 0 and at most 1. 1 gives the garment itself.

    Returns:
        The coarser garment, and which vertex of the full one each of its vertices is.

    Raises:
        BadInput: `share` is not such a number, or leaves fewer than 50 vertices.
    """
    count = len(garment.vertices)
    if not 0 < share <= 1:
        raise BadInput("a share of vertices is above 0 and at most 1", share, "use 1 for all, 0.25 for a quarter")
    if share == 1:
        return garment, np.arange(count, dtype=np.int32)
    if share * count < LEAST:
        got = f"{share} of {count}"
        raise BadInput(f"garment '{garment.name}' needs {LEAST} vertices or more", got, f"keep {LEAST / count:.2g}")
    kinds = np.stack([garment.pins.joints, np.isinf(garment.pins.stiffness)], axis=1)
    _, kind = np.unique(kinds, axis=0, return_inverse=True)
    bound = np.zeros(count, np.int64)
    bound[garment.pins.vertices] = 1 << kind.reshape(-1)
    mesh = coarser(garment.vertices, garment.faces, round(share * count), rest_edges=garment.rest_edges, bound=bound)
    numbers = np.full(count, -1, np.int32)
    numbers[mesh.kept] = np.arange(len(mesh.kept))
    ends = np.searchsorted(mesh.kept, np.cumsum([0, *(piece.vertex_count for piece in garment.worn)]))
    pieces = tuple(
        replace(piece, vertex_count=int(left)) for piece, left in zip(garment.pieces, np.diff(ends), strict=False)
    )
    left = replace(
        garment,
        vertices=garment.vertices[mesh.kept],
        faces=mesh.faces,
        rest_edges=mesh.rest_edges,
        pins=_kept(garment.pins, numbers),
        chains=(),
        pieces=pieces,
    )
    return left, mesh.kept


def _kept(pins: Pins, numbers: Int[np.ndarray, " verts"]) -> Pins:
    """The pins of vertices that are left."""
    there = numbers[pins.vertices] >= 0
    return replace(
        pins,
        vertices=numbers[pins.vertices[there]],
        body_faces=pins.body_faces[there],
        barycentric=pins.barycentric[there],
        heights=pins.heights[there],
        joints=pins.joints[there],
        offsets=pins.offsets[there],
        stiffness=pins.stiffness[there],
    )
