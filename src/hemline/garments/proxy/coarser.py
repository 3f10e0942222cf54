"""Reduces a garment to fewer vertices, for levels of detail and for proxies."""

from dataclasses import replace

import numpy as np

from hemline.arrays import Int
from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.garments.pins import Pins
from hemline.meshes import coarsen

LEAST_VERTICES = 50
"""Least number of vertices of a garment."""


def coarser_garment(garment: Garment, fraction: float) -> tuple[Garment, Int[np.ndarray, " kept"]]:
    """Reduces a garment to some of its vertices; cut, pins, pieces and material stay.

    Rims and pinned lines stay where they are. Chains that were made by hand are dropped, as they lie on the full
    garment.

    Args:
        garment: The full garment.
        fraction: Fraction of its vertices to keep, above 0 and at most 1. 1 returns the garment itself.

    Returns:
        The coarser garment, and for each of its vertices the number of that vertex in the full garment.

    Raises:
        BadInput: `fraction` is out of range, or leaves fewer than 50 vertices.
    """
    count = len(garment.vertices)
    if not 0 < fraction <= 1:
        raise BadInput("a share of vertices is above 0 and at most 1", fraction, "use 1 for all, 0.25 for a quarter")
    if fraction == 1:
        return garment, np.arange(count, dtype=np.int32)
    if fraction * count < LEAST_VERTICES:
        what, got = f"garment '{garment.name}' needs {LEAST_VERTICES} vertices or more", f"{fraction} of {count}"
        raise BadInput(what, got, f"keep {LEAST_VERTICES / count:.2g}")
    kinds = np.stack([garment.pins.joints, np.isinf(garment.pins.stiffness)], axis=1)
    _, kind = np.unique(kinds, axis=0, return_inverse=True)
    bound = np.zeros(count, np.int64)
    bound[garment.pins.vertices] = 1 << kind.reshape(-1)
    mesh = coarsen(garment.vertices, garment.faces, round(fraction * count), rest_edges=garment.rest_edges, bound=bound)
    numbers = np.full(count, -1, np.int32)
    numbers[mesh.kept] = np.arange(len(mesh.kept))
    ends = np.searchsorted(mesh.kept, np.cumsum([0, *(piece.vertex_count for piece in garment.layers)]))
    pieces = tuple(
        replace(piece, vertex_count=int(coarse)) for piece, coarse in zip(garment.pieces, np.diff(ends), strict=False)
    )
    coarse = replace(
        garment,
        vertices=garment.vertices[mesh.kept],
        faces=mesh.faces,
        rest_edges=mesh.rest_edges,
        pins=_select_pins(garment.pins, numbers),
        chains=(),
        pieces=pieces,
    )
    return coarse, mesh.kept


def _select_pins(pins: Pins, numbers: Int[np.ndarray, " verts"]) -> Pins:
    """Returns the pins of the vertices that are kept, with their new numbers."""
    is_kept = numbers[pins.vertices] >= 0
    return replace(
        pins,
        vertices=numbers[pins.vertices[is_kept]],
        body_faces=pins.body_faces[is_kept],
        barycentric=pins.barycentric[is_kept],
        heights=pins.heights[is_kept],
        joints=pins.joints[is_kept],
        offsets=pins.offsets[is_kept],
        stiffness=pins.stiffness[is_kept],
    )
