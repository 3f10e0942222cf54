"""Garments worn together in a player: which of them settle, and what keeps each out of those beneath it."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np

from hemline.animators.base import Animator, Settled
from hemline.animators.together import AnimatorTogether
from hemline.arrays import Bool, Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.collide import (
    Cover,
    Guarantee,
    LayeredProjector,
    LayersState,
    PosedSurface,
    ProjectionReport,
    Projector,
    ProjectorState,
    GarmentOnBody,
)
from hemline.errors import BadInput
from hemline.garments import Garment, pieces_apart
from hemline.playback.detail import LevelOnBody

THICKNESS_MM = 1.5
"""Least distance of a garment from the one beneath it, where it must be moved [mm]."""
THICKEST_MM = 10.0


def check_thickness(thickness_mm: float) -> None:
    """Refuse a distance between garments that cloth does not have.

    Args:
        thickness_mm: The distance [mm].

    Raises:
        BadInput: It is not above 0 and at most 10 mm.
    """
    if not 0 < thickness_mm <= THICKEST_MM:
        raise BadInput(
            f"garments lie above 0 and at most {THICKEST_MM:g} mm over each other",
            f"thickness_mm = {thickness_mm}",
            f"leave it out for {THICKNESS_MM:g}",
        )


def settled_vertices(animator: Animator) -> Bool[np.ndarray, " verts"]:
    """Which vertices of its garment are of `SettledGarments` animators.

    Args:
        animator: One animator, or several worn together.
    """
    parts = animator.parts if isinstance(animator, AnimatorTogether) else (animator,)
    return np.concatenate([np.full(len(part.garment.vertices), isinstance(part, Settled)) for part in parts])


def rest_function(animator: Animator) -> Callable[[Any], Vertices]:
    """What takes a State to the garment at rest on its body (verts, 3) [m]: zeros where the animator is not `SettledGarments`.

    Args:
        animator: One animator, or several worn together, whose States come together.
    """
    if isinstance(animator, AnimatorTogether):
        each = [rest_function(part) for part in animator.parts]
        return lambda states: np.concatenate([rest(state) for rest, state in zip(each, states, strict=True)])
    if isinstance(animator, Settled):
        return animator.at_rest
    nowhere = np.zeros_like(animator.garment.vertices)
    return lambda state: nowhere


def covers_of(garment: Garment, shaped: ShapedBody) -> tuple[Cover, ...]:
    """What moves each piece of a garment over the skin: the cloth nearest to it, whatever is worn over that.

    Args:
        garment: One garment, or several that are worn together.
        shaped: The body on which it was made.
    """
    pieces = [garment.faces[garment.face_pieces == at] for at in range(len(garment.worn))]
    each = pieces if len(pieces) > 1 else [garment.faces]
    return tuple(Cover.prepare(shaped, garment.vertices, faces) for faces in each)


def projector_of(
    level: LevelOnBody,
    worn: GarmentOnBody,
    settled: Bool[np.ndarray, " verts"],
    thickness_mm: float,
    *,
    guarantee: Guarantee,
    measure: bool,
    whole: bool,
    detail: float,
) -> Projector | LayeredProjector:
    """The projection of one garment, or of several that are worn together.

    Args:
        level: One garment, or several as its pieces, and the body.
        worn: Both.
        settled: As `settled_vertices`.
        thickness_mm: Distance of garments [mm].
        guarantee: As for `Projector.prepare`.
        measure: As for `Projector.prepare`.
        whole: As for `Player.prepare`.
        detail: As for `Player.prepare`.
    """
    garment, body = level.garment, level.body
    pieces = pieces_apart(garment)
    if len(pieces) == 1:
        return Projector.prepare(body, garment.vertices, garment.faces, guarantee=guarantee, measure=measure, on_body=worn)
    bounds = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    return LayeredProjector.prepare(
        body,
        pieces,
        worn,
        thickness=1e-3 * thickness_mm,
        guarantee=guarantee,
        measure=measure,
        whole=tuple(whole and not settled[low:high].all() for low, high in pairwise(bounds)),
        cover=whole,
        detail=detail,
    )


def projected_by(
    projector: Projector | LayeredProjector,
    state: ProjectorState | LayersState,
    posed: PosedBody,
    vertices: Vertices,
    dt: float,
    surface: PosedSurface,
) -> tuple[ProjectorState | LayersState, Vertices, ProjectionReport]:
    """One frame of either, see `Projector.project`.

    Args:
        projector: Of one garment, or of several.
        state: Its own, from the frame before.
        posed: The body now.
        vertices: The garment [m].
        dt: Time since the frame before [s].
        surface: The body's surface now.
    """
    if isinstance(projector, LayeredProjector):
        assert isinstance(state, LayersState)
        return projector.project(state, posed, vertices, dt=dt, surface=surface)
    assert isinstance(state, ProjectorState)
    return projector.project(state, posed, vertices, dt=dt, surface=surface)
