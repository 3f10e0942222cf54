"""Garments worn together in a player: which of them lie close to the body, and the projection of one or several."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from hemline.animators.base import Animator, CloseFitting
from hemline.animators.together import AnimatorTogether
from hemline.arrays import Bool, Vertices
from hemline.bodies import PosedBody, ShapedBody
from hemline.collide import (
    CloseCloth,
    Cover,
    GarmentOnBody,
    Guarantee,
    LayeredProjector,
    NearestSkin,
    PosedSurface,
    ProjectionReport,
    Projector,
)
from hemline.errors import BadInput
from hemline.garments import Garment, split_pieces
from hemline.playback.detail import LevelOnBody

THICKNESS_MM = 1.5
"""Least distance of a garment from the one beneath it, where it must be moved [mm]."""
THICKEST_MM = 10.0
"""Largest such distance [mm]."""


def check_thickness(thickness_mm: float) -> None:
    """Refuses a distance between garments that cloth does not have.

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


def close_vertices(animator: Animator) -> Bool[np.ndarray, " verts"]:
    """Returns which vertices of the garment belong to garments that lie close to the body as a whole.

    Args:
        animator: One animator, or several worn together.
    """
    parts = animator.parts if isinstance(animator, AnimatorTogether) else (animator,)
    return np.concatenate([np.full(len(part.garment.vertices), _limit(part) > 0) for part in parts])


def stretch_limits(animator: Animator) -> tuple[float, ...]:
    """Returns how much longer than at rest edges may be, for each garment of an animator; 0 if it does not lie close.

    Args:
        animator: One animator, or several worn together.
    """
    parts = animator.parts if isinstance(animator, AnimatorTogether) else (animator,)
    found = []
    for part in parts:
        found += [_limit(part)] * len(part.garment.layers)
    return tuple(found)


def _limit(animator: Animator) -> float:
    return animator.stretch_limit if isinstance(animator, CloseFitting) else 0.0


def rest_function(animator: Animator) -> Callable[[Any, ShapedBody], Vertices]:
    """Returns a function from a State and its body to the garment at rest on that body (verts, 3) [m].

    Vertices of garments that do not lie close to the body as a whole are zero.

    Args:
        animator: One animator, or several worn together, with a tuple of their States.
    """
    if isinstance(animator, AnimatorTogether):
        each = [rest_function(part) for part in animator.parts]
        return lambda states, shaped: np.concatenate(
            [rest(state, shaped) for rest, state in zip(each, states, strict=True)]
        )
    if isinstance(animator, CloseFitting) and animator.stretch_limit > 0:
        return animator.at_rest
    nowhere = np.zeros_like(animator.garment.vertices)
    return lambda state, shaped: nowhere


def covers_of(garment: Garment, shaped: ShapedBody, close: Bool[np.ndarray, " verts"]) -> tuple[Cover, ...]:
    """Returns a `Cover` for each piece that does not lie close as a whole, each of the cloth nearest to the skin.

    Args:
        garment: One garment, or several worn together.
        shaped: The body on which it was made.
        close: Result of `close_vertices`.
    """
    pieces = [garment.faces[garment.face_pieces == at] for at in range(len(garment.layers))]
    each = pieces if len(pieces) > 1 else [garment.faces]
    return tuple(Cover.prepare(shaped, garment.vertices, faces) for faces in each if not close[faces].all())


class ClosePiece(NamedTuple):
    """A piece of the garment of a player that lies close to the body, and what holds it within its limits."""

    low: int
    """The first vertex of the piece."""
    high: int
    """The vertex after its last one."""
    cloth: CloseCloth


def close_pieces(
    garment: Garment, on_body: GarmentOnBody, limits: tuple[float, ...], level: LevelOnBody, body: ShapedBody
) -> tuple[ClosePiece, ...]:
    """Prepares the pieces of a garment that lie close to the body.

    Args:
        garment: One garment, or several worn together.
        on_body: The garment in relation to the collider.
        limits: Result of `stretch_limits`.
        level: The level of detail; skin is covered only where its collider is the body.
        body: The body that wears the garment.
    """
    pieces, low, prepared = split_pieces(garment), 0, list[ClosePiece]()
    made_on = body.body.shaped(garment.body_betas) if level.body is body else None
    for piece, limit in zip(pieces, limits, strict=True):
        high = low + len(piece.vertices)
        if limit:
            near = on_body
            if len(pieces) > 1:
                known = None if made_on is None else made_on.vertices
                near = GarmentOnBody.of(level.body, piece.vertices, patches=on_body.patches, made_on=known)
            skin = None if made_on is None else made_on.bare  # an accessory is not covered: cloth goes around it
            prepared.append(ClosePiece(low, high, CloseCloth.prepare(skin, piece, near, stretch=limit)))
        low = high
    return tuple(prepared)


def hold_close(
    pieces: tuple[ClosePiece, ...], vertices: Vertices, rest: Vertices, posed: PosedBody, surface: PosedSurface
) -> tuple[Vertices, NearestSkin]:
    """Holds the pieces of a garment that lie close to the body within their limits.

    Args:
        pieces: Result of `close_pieces`.
        vertices: All vertices of the garment [m].
        rest: The garment at rest on its body [m].
        posed: The collider in this frame.
        surface: Surface of the collider in this frame.

    Returns:
        The garment [m], and where the skin is next to these pieces.
    """
    held, contact = vertices.copy(), NearestSkin.unknown(len(vertices))
    for low, high, cloth in pieces:
        held[low:high], near = cloth.step(posed, vertices[low:high], rest[low:high], surface=surface)
        for known, found in zip(contact, near, strict=True):
            known[low:high] = found
    return held, contact


@runtime_checkable
class FrameProjector(Protocol):
    """Projection of one garment, or of several worn together, out of the body."""

    @property
    def on_body(self) -> GarmentOnBody:
        """The garment in relation to the body."""
        ...

    def start(self) -> Any:
        """Returns the state before the first frame."""
        ...

    def project(
        self,
        state: Any,
        posed: PosedBody,
        vertices: Vertices,
        *,
        dt: float,
        surface: PosedSurface | None,
        contact: NearestSkin | None,
    ) -> tuple[Any, Vertices, ProjectionReport]:
        """Projects one frame, see `hemline.collide.Projector.project`.

        Args:
            state: State of this projector after the previous frame.
            posed: The body in this frame.
            vertices: The garment [m].
            dt: Time since the previous frame [s].
            surface: Surface of the body in this frame.
            contact: Where the skin is, from a step before this one.
        """
        ...


def projector_of(
    level: LevelOnBody,
    on_body: GarmentOnBody,
    close: Bool[np.ndarray, " verts"],
    thickness_mm: float,
    *,
    guarantee: Guarantee,
    measure: bool,
    whole: bool,
    detail: float,
) -> FrameProjector:
    """Prepares the projection of one garment, or of several worn together.

    Args:
        level: The garment, of several pieces where several garments are worn, and the body.
        on_body: The garment in relation to the body.
        close: Result of `close_vertices`.
        thickness_mm: Least distance of a garment from the one beneath it [mm].
        guarantee: See `Projector.prepare`.
        measure: See `Projector.prepare`.
        whole: See `Player.prepare`.
        detail: See `Player.prepare`.
    """
    garment, body = level.garment, level.body
    pieces = split_pieces(garment)
    if len(pieces) == 1:
        return Projector.prepare(
            body, garment.vertices, garment.faces, guarantee=guarantee, measure=measure, on_body=on_body
        )
    bounds = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    return LayeredProjector.prepare(
        body,
        pieces,
        on_body,
        thickness=1e-3 * thickness_mm,
        guarantee=guarantee,
        measure=measure,
        whole=tuple(whole and not close[low:high].all() for low, high in pairwise(bounds)),
        cover=whole,
        detail=detail,
    )
