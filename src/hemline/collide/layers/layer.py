"""Keeps one garment out of another beneath it, as every garment is kept out of the body."""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float, Int, Points, Vertices
from hemline.collide.cover.cover import Cover
from hemline.collide.projection.prepared import Guarantee, ProjectionSettings, ProjectorState
from hemline.collide.projection.project import Projector
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.collide.whole.whole_cloth import WholeCloth, WholeSettings, WholeState
from hemline.collide.winding.numbers import inside

from .closed_cloth import ClosedCloth

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments import Garment

MARGIN_THICKNESSES = 3.0
"""Vertices nearer to the cloth beneath than this many thicknesses are moved outward, like vertices near the skin."""
ROUNDING_FACTOR = np.float32(1.0001)
"""Factor that allows for the rounding of lengths measured in another frame."""
HOLD_THICKNESSES = 2.0
"""Least height of the whole-cloth step's samples over the cloth beneath, in thicknesses."""


@dataclass(frozen=True)
class LayerState:
    """State of a layer."""

    whole: WholeState | None
    projector: ProjectorState


@dataclass(frozen=True, eq=False)
class Layer:
    """One garment over another; the inner one takes the place of the body in the three steps that keep cloth out of it.

    Attributes:
        closed: The garment beneath, closed at its rims.
        whole: Keeps the outer garment in one piece; None for settled garments, whose shape must not be drawn in.
        cover: Moves triangles of the outer garment out over cloth that would show through; None without these steps.
        projector: Moves vertices of the outer garment out of the closed garment.
    """

    closed: ClosedCloth
    whole: WholeCloth | None
    cover: Cover | None
    projector: Projector

    @classmethod
    def prepare(
        cls,
        shaped: "ShapedBody",
        inner: "Garment",
        outer: "Garment",
        *,
        thickness: float,
        guarantee: Guarantee = "exact",
        whole: bool = True,
        cover: bool = True,
        detail: float = 1.0,
    ) -> Self:
        """Closes the garment beneath and prepares the outer one.

        Args:
            shaped: The body that wears both.
            inner: The garment beneath.
            outer: The garment over it.
            thickness: Smallest distance from the cloth beneath at which a displaced vertex may end [m].
            guarantee: See `Projector.prepare`.
            whole: Whether to keep the outer garment in one piece.
            cover: Whether to move the outer garment out where the cloth beneath would show through it.
            detail: See `WholeSettings.at_detail`.

        Raises:
            BadBody: The garment beneath cannot be closed: an edge has more than two triangles.
        """
        closed = ClosedCloth.of(len(inner.vertices), inner.faces)
        solid = closed.as_body(shaped, inner.vertices)
        on_body = GarmentOnBody.of(solid, outer.vertices)
        settings = WholeSettings(margin=HOLD_THICKNESSES * thickness, least=thickness).at_detail(detail)
        return cls(
            closed=closed,
            whole=WholeCloth.prepare(solid, _without_pins(outer), on_body, settings) if whole else None,
            cover=Cover.prepare(solid, outer.vertices, outer.faces) if cover else None,
            projector=Projector.prepare(
                solid,
                outer.vertices,
                outer.faces,
                guarantee=guarantee,
                settings=ProjectionSettings(margin=MARGIN_THICKNESSES * thickness, gap=thickness),
                measure=False,
                on_body=on_body,
            ),
        )

    def start(self) -> LayerState:
        """Returns the state before the first frame."""
        return LayerState(self.whole.start() if self.whole else None, self.projector.start())

    def step(
        self, state: LayerState, posed: "PosedBody", inner: Vertices, outer: Vertices, dt: float
    ) -> tuple[LayerState, Vertices, Int[np.ndarray, " pinched"]]:
        """Moves the outer garment out of the one beneath, for one frame.

        Args:
            state: State from `start`, or from the frame before; it is not changed.
            posed: The body in this frame.
            inner: The garment beneath, as it is shown [m].
            outer: The outer garment [m].
            dt: Time since the frame before [s].

        Returns:
            The next state, the outer garment [m], and the vertices of it for which no free position was found nearby.
        """
        on_body, skin = self.projector.on_body, self.closed.vertices(inner)
        surface = PosedSurface.at(on_body.patches, posed.transforms[on_body.key_joint], skin)
        whole = state.whole
        if self.whole and whole:
            whole, outer = _with_current_lengths(self.whole, outer).step(whole, posed, outer, dt=dt, surface=surface)
        outer = self.cover.step(skin, outer) if self.cover else outer
        moved, outer, report = self.projector.project(state.projector, posed, outer, dt=dt, surface=surface)
        return LayerState(whole, moved), outer, report.pinched

    def behind(self, inner: Vertices, outer: Vertices, among: Int[np.ndarray, " some"]) -> Int[np.ndarray, " behind"]:
        """Returns the vertices of the outer garment that are behind the cloth beneath.

        Args:
            inner: The garment beneath [m].
            outer: The outer garment [m].
            among: Vertices of the outer garment to test.
        """
        return among[inside(self.closed.vertices(inner), self.closed.faces, outer[among])] if len(among) else among


def _with_current_lengths(whole: WholeCloth, outer: Vertices) -> WholeCloth:
    """Returns a step to which no edge is too long at its present length: where nothing is pushed, nothing moves."""
    points, (fine, coarse) = outer[whole.on_body.order], (whole.fine, whole.coarse)
    now = (_lengths(points, fine.edges) / whole.settings.stretch, _lengths(points[coarse.controls], coarse.edges))
    longest = [
        np.maximum(model.lengths, ROUNDING_FACTOR * each) for model, each in zip((fine, coarse), now, strict=True)
    ]
    return replace(whole, fine=fine._replace(lengths=longest[0]), coarse=coarse._replace(lengths=longest[1]))


def _lengths(points: Points, edges: Int[np.ndarray, "edges 2"]) -> Float[np.ndarray, " edges"]:
    along = points[edges[:, 1]] - points[edges[:, 0]]
    return np.sqrt(np.einsum("ec,ec->e", along, along))


def _without_pins(garment: "Garment") -> "Garment":
    """Returns a garment without pins: it was pinned to the body already."""
    pins = garment.pins
    none = {each.name: getattr(pins, each.name)[:0] for each in fields(pins)}
    return replace(garment, pins=replace(pins, **none))
