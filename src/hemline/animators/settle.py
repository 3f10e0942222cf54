"""A garment at rest before it is played; garments worn together that start through each other are moved apart."""

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies import ShapedBody
from hemline.collide import LayeredProjector, GarmentOnBody
from hemline.errors import SimulationFailed
from hemline.garments import Garment, pieces_apart
from hemline.garments.pieces import GAP
from hemline.meshes import crossing_edges, edges
from hemline.sim.rest.settle import rest_state
from hemline.sim.rest.settling import MAX_CROSSING_RATIO_AT_START
from hemline.sim.settings import SimSettings

FRAME_SECONDS = 1 / 30
"""Time that the projection is told has passed [s]."""


def settle_garment(garment: Garment, shaped: ShapedBody, *, self_contact: bool = True) -> Vertices:
    """A garment at rest on a body in its rest pose (verts, 3) [m], float64.

    Garments worn together settle together. Where they cannot, as cloth that starts through other cloth does not come
    out of it again, each settles alone, and is moved out of those beneath it, as it is in play.

    Args:
        garment: On that shape of the body.
        shaped: The body.
        self_contact: Whether cloth meets cloth as it settles.

    Raises:
        SimulationFailed: It could not be settled; or it goes through itself, or garments through each other, even so.
    """
    settings = SimSettings(self_contact=self_contact)
    try:
        return rest_state(garment, shaped, settings).positions
    except SimulationFailed as failure:
        pieces = pieces_apart(garment)
        if len(pieces) < 2:
            raise
        alone = np.concatenate([rest_state(piece, shaped, settings).positions for piece in pieces])
        apart = separate_garments(garment, shaped, alone.astype(np.float32))
        if len(crossing_edges(apart, garment.faces)) > MAX_CROSSING_RATIO_AT_START * len(edges(garment.faces)):
            raise failure
        return apart.astype(np.float64)


def separate_garments(garment: Garment, shaped: ShapedBody, vertices: Vertices) -> Vertices:
    """Garments worn together, each moved out of those beneath it, and out of the body [m].

    Args:
        garment: As it was made, on that shape of the body.
        shaped: The body.
        vertices: Where they are, the body in its rest pose [m].
    """
    worn, pieces = GarmentOnBody.of(shaped, garment.vertices), pieces_apart(garment)
    whole = (True,) * len(pieces)
    projector = LayeredProjector.prepare(shaped, pieces, worn, thickness=GAP, measure=False, whole=whole)
    posed = shaped.posed(shaped.rest_pose)
    return projector.project(projector.start(), posed, vertices, dt=FRAME_SECONDS)[1]
