"""Garments worn together that start through each other: the outer ones moved out of the inner ones as they settled."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Vertices
from hemline.collide import LayeredProjector, WornGarment
from hemline.garments.garment import Garment
from hemline.garments.pieces import GAP
from hemline.garments.worn_together import pieces_apart
from hemline.meshes import crossing_edges, edges

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

MOST_THROUGH = 0.005
"""Share of the edges of garments worn together that may start through another one: so few open as the cloth settles."""
A_FRAME = 1 / 30
"""Time that the projection is told has passed [s]."""


def share_through(garment: Garment) -> float:
    """The share of the edges that go through a triangle of another piece.

    Args:
        garment: Several pieces, or one, which goes through no other.
    """
    if len(garment.worn) < 2:
        return 0.0
    through = len(crossing_edges(garment.vertices, garment.faces))
    alone = sum(len(crossing_edges(piece.vertices, piece.faces)) for piece in pieces_apart(garment))
    return max(0, through - alone) / len(edges(garment.faces))


def moved_apart(garment: Garment, shaped: "ShapedBody", settled: Callable[[Garment], Vertices]) -> Garment:
    """The garment with each piece as it settles alone, out of the body and of those beneath it.

    Cloth in contact with itself does not come apart again where it starts through itself; what keeps garments out of
    each other in play does not ask how they came there.

    Args:
        garment: Several pieces, on this shape of the body.
        shaped: The body.
        settled: A piece at rest on it [m].
    """
    pieces = pieces_apart(garment)
    projector = LayeredProjector.prepare(
        shaped,
        pieces,
        WornGarment.of(shaped, garment.vertices),
        thickness=GAP,
        measure=False,
        whole=(True,) * len(pieces),
    )
    alone = np.concatenate([settled(piece).astype(np.float32) for piece in pieces])
    _, vertices, _ = projector.project(projector.start(), shaped.posed(shaped.rest_pose), alone, dt=A_FRAME)
    return replace(garment, vertices=vertices)
