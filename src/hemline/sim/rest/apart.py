"""Garments worn together that start through each other: the outer ones moved out of the inner ones as they settled."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Vertices
from hemline.collide import LayeredProjector, WornGarment
from hemline.garments.garment import Garment
from hemline.garments.pieces import GAP
from hemline.garments.worn_together import pieces_apart
from hemline.sim.contact.contact_history import HistoryFaces
from hemline.sim.step.frame_end import Cleaned, FrameEnd

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

A_FRAME = 1 / 30
"""Time that the projection is told has passed [s]."""


class ApartEnd(FrameEnd):
    """As `FrameEnd`, with each piece out of those beneath it, too.

    Cloth in contact with itself does not come apart again where it has gone through itself, and cloth that was
    stretched over a garment beneath springs back through it within a frame. So it is moved out of it frame by frame.

    Args:
        garment: Several pieces, on this shape of the body.
        shaped: The body.
    """

    def __init__(self, garment: Garment, shaped: "ShapedBody"):
        super().__init__(garment, shaped)
        pieces = pieces_apart(garment)
        self._layers = LayeredProjector.prepare(
            shaped,
            pieces,
            WornGarment.of(shaped, garment.vertices),
            thickness=GAP,
            measure=False,
            whole=(True,) * len(pieces),
        )
        self._over = self._layers.start()

    def clean(
        self,
        posed: "PosedBody",
        positions: Float[np.ndarray, "verts 3"],
        seconds: float,
        contact_history: HistoryFaces | None = None,
    ) -> Cleaned:
        """Project one frame; see `FrameEnd.clean`."""
        before = positions.astype(np.float32)
        self._over, after, _ = self._layers.project(self._over, posed, before, dt=seconds)
        moved = (after != before).any(axis=1)
        return super().clean(posed, np.where(moved[:, None], after, positions), seconds, contact_history)


def moved_apart(garment: Garment, shaped: "ShapedBody", settled: Callable[[Garment], Vertices]) -> Garment:
    """The garment with each piece as it settles alone, out of the body and of those beneath it.

    Args:
        garment: Several pieces, on this shape of the body.
        shaped: The body.
        settled: A piece at rest on it [m].
    """
    alone = np.concatenate([settled(piece) for piece in pieces_apart(garment)])
    posed = shaped.posed(shaped.rest_pose)
    return replace(
        garment, vertices=ApartEnd(garment, shaped).clean(posed, alone, A_FRAME).positions.astype(np.float32)
    )
