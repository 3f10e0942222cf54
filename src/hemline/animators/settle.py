"""Settles a garment at rest before it is played; garments worn together that start through each other are separated."""

import warnings

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.collide import GarmentOnBody, LayeredProjector
from hemline.errors import HemlineWarning, SimulationFailed
from hemline.garments import Garment, split_pieces
from hemline.garments.pieces import GAP
from hemline.meshes import crossing_edges, edges
from hemline.sim.rest.settle import rest_state
from hemline.sim.rest.settling import MAX_CROSSING_RATIO_AT_START
from hemline.sim.rest.tangles import MOST_CROSSING_WORN, TangledCloth
from hemline.sim.settings import SimSettings

FRAME_SECONDS = 1 / 30
"""Time step of the projection that separates garments [s]."""


def settle_garment(garment: Garment, shaped: ShapedBody, *, self_contact: bool = True) -> Vertices:
    """Settles a garment on a body in its rest pose; returns its vertices (verts, 3) [m], float64.

    Garments worn together settle together. If they cannot, since cloth that starts through other cloth does not come
    out of it again, each settles alone and is pushed out of the garments beneath it, as in play. A single garment that
    goes through itself in a few places is played as it is, with a warning.

    Args:
        garment: The garment on that shape of the body.
        shaped: The body.
        self_contact: Whether cloth collides with cloth while it settles.

    Raises:
        SimulationFailed: The garment could not be settled, or cloth still goes through cloth.

    Warns:
        HemlineWarning: A few edges go through the cloth.
    """
    settings = SimSettings(self_contact=self_contact)
    try:
        return rest_state(garment, shaped, settings).positions
    except SimulationFailed as failure:
        pieces = split_pieces(garment)
        if len(pieces) < 2:
            if isinstance(failure, TangledCloth):
                return _settle_tangled(garment, shaped, settings, failure)
            raise
        alone = np.concatenate([rest_state(piece, shaped, settings).positions for piece in pieces])
        separate = separate_garments(garment, shaped, alone.astype(np.float32))
        if len(crossing_edges(separate, garment.faces)) > MAX_CROSSING_RATIO_AT_START * len(edges(garment.faces)):
            raise failure
        return separate.astype(np.float64)


def _settle_tangled(garment: Garment, shaped: ShapedBody, settings: SimSettings, failure: TangledCloth) -> Vertices:
    """Settles a garment that may go through itself in a few places; raises the failure if there are more."""
    try:
        rest = rest_state(garment, shaped, settings, max_crossing=MOST_CROSSING_WORN)
    except TangledCloth:
        raise failure from None
    got = f"{rest.figures['self_crossing_percent']:.1f} % of its edges"
    cure = "a finer mesh, or one whose panels lie apart, moves better"
    warnings.warn(HemlineWarning(f"'{garment.name}' goes through itself at rest", got, cure), stacklevel=4)
    return rest.positions


def separate_garments(garment: Garment, shaped: ShapedBody, vertices: Vertices) -> Vertices:
    """Pushes garments worn together out of the garments beneath them and out of the body (verts, 3) [m].

    Args:
        garment: The garments as they were made, on that shape of the body.
        shaped: The body.
        vertices: Positions of the garments on the body in its rest pose (verts, 3) [m].
    """
    on_body, pieces = GarmentOnBody.of(shaped, garment.vertices), split_pieces(garment)
    whole = (True,) * len(pieces)
    projector = LayeredProjector.prepare(shaped, pieces, on_body, thickness=GAP, measure=False, whole=whole)
    posed = shaped.posed(shaped.rest_pose)
    return projector.project(projector.start(), posed, vertices, dt=FRAME_SECONDS)[1]
