"""One garment over another: kept whole, covering, and out of the cloth beneath, as every garment is out of the body."""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Float, Int, Points, Vertices
from hemline.collide.cover.cover import Cover
from hemline.collide.projection.prepared import Guarantee, ProjectionSettings, ProjectorState
from hemline.collide.projection.project import Projector
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.whole.whole_cloth import WholeCloth, WholeSettings, WholeState
from hemline.collide.winding.numbers import inside

from .closed_cloth import ClosedCloth

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments import Garment

MARGIN_THICKNESSES = 3.0
"""Vertices nearer than so many thicknesses to the cloth beneath are moved outward, as those near the skin are."""
ROUNDING_FACTOR = np.float32(1.0001)
"""Room for the rounding of lengths that are seen from another frame."""
HOLD_THICKNESSES = 2.0
"""The whole-cloth step holds samples at so many thicknesses over the cloth beneath."""


@dataclass(frozen=True)
class LayerState:
    """What moves from frame to frame."""

    whole: WholeState | None
    projector: ProjectorState


@dataclass(frozen=True, eq=False)
class Layer:
    """A garment over another one, which takes the place of the body in the three steps that keep cloth out of it.

    Attributes:
        closed: The garment beneath, closed at its rims.
        whole: What keeps the outer garment in one piece; None for settled garments, which nothing may draw in.
        cover: What moves its triangles out over vertices of the cloth that they cover; None without these steps.
        projector: What moves its vertices out of the closed garment.
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
        """Close the garment beneath and make the outer one ready to be kept out of it.

        Args:
            shaped: The body that wears both.
            inner: The garment beneath.
            outer: The garment over it.
            thickness: No vertex that is displaced ends nearer to the cloth beneath [m].
            guarantee: As for `Projector.prepare`.
            whole: Keep the outer garment in one piece.
            cover: Move it over cloth that looks through.
            detail: As for `WholeSettings.at_detail`.

        Raises:
            BadBody: The garment beneath cannot be closed: an edge has more than two triangles.
        """
        closed = ClosedCloth.of(len(inner.vertices), inner.faces)
        solid = closed.as_body(shaped, inner.vertices)
        worn = GarmentOnBody.of(solid, outer.vertices)
        settings = WholeSettings(margin=HOLD_THICKNESSES * thickness, least=thickness).at_detail(detail)
        return cls(
            closed=closed,
            whole=WholeCloth.prepare(solid, _without_pins(outer), worn, settings) if whole else None,
            cover=Cover.prepare(solid, outer.vertices, outer.faces) if cover else None,
            projector=Projector.prepare(
                solid,
                outer.vertices,
                outer.faces,
                guarantee=guarantee,
                settings=ProjectionSettings(margin=MARGIN_THICKNESSES * thickness, gap=thickness),
                measure=False,
                worn=worn,
            ),
        )

    def start(self) -> LayerState:
        """The state before the first frame."""
        return LayerState(self.whole.start() if self.whole else None, self.projector.start())

    def step(
        self, state: LayerState, posed: "PosedBody", inner: Vertices, outer: Vertices, dt: float
    ) -> tuple[LayerState, Vertices, Int[np.ndarray, " pinched"]]:
        """Move the outer garment out of the one beneath.

        Args:
            state: From `start`, or from the frame before; it is not changed.
            posed: The body in this frame.
            inner: The garment beneath, as it is shown [m].
            outer: The outer garment [m].
            dt: Time since the frame before [s].

        Returns:
            The state after, the outer garment [m], and which of its vertices found no free place near.
        """
        worn, skin = self.projector.on_body, self.closed.vertices(inner)
        surface = PosedSurface.at(worn.patches, posed.transforms[worn.key_joint], skin)
        whole = state.whole
        if self.whole and whole:
            whole, outer = _with_current_lengths(self.whole, outer).step(whole, posed, outer, dt=dt, surface=surface)
        outer = self.cover.step(skin, outer) if self.cover else outer
        moved, outer, report = self.projector.project(state.projector, posed, outer, dt=dt, surface=surface)
        return LayerState(whole, moved), outer, report.pinched

    def behind(self, inner: Vertices, outer: Vertices, among: Int[np.ndarray, " some"]) -> Int[np.ndarray, " behind"]:
        """Vertices of the outer garment behind the cloth beneath.

        Args:
            inner: The garment beneath [m].
            outer: The outer garment [m].
            among: Which of its vertices are asked.
        """
        return among[inside(self.closed.vertices(inner), self.closed.faces, outer[among])] if len(among) else among


def _with_current_lengths(whole: WholeCloth, outer: Vertices) -> WholeCloth:
    """The step for which no edge is too long that is as long already: where nothing is pushed, nothing moves."""
    points, (fine, coarse) = outer[whole.on_body.order], (whole.fine, whole.coarse)
    now = (_lengths(points, fine.edges) / whole.settings.stretch, _lengths(points[coarse.controls], coarse.edges))
    longest = [np.maximum(model.lengths, ROUNDING_FACTOR * each) for model, each in zip((fine, coarse), now, strict=True)]
    return replace(whole, fine=fine._replace(lengths=longest[0]), coarse=coarse._replace(lengths=longest[1]))


def _lengths(points: Points, edges: Int[np.ndarray, "edges 2"]) -> Float[np.ndarray, " edges"]:
    ways = points[edges[:, 1]] - points[edges[:, 0]]
    return np.sqrt(np.einsum("ec,ec->e", ways, ways))


def _without_pins(garment: "Garment") -> "Garment":
    """The garment without pins: where it is pinned to the body it has been put already."""
    pins = garment.pins
    none = {each.name: getattr(pins, each.name)[:0] for each in fields(pins)}
    return replace(garment, pins=replace(pins, **none))
