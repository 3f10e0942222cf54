"""The final projection of garments worn together: each is moved out of those beneath it, then out of the body."""

import time
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Int, Vertices
from hemline.collide.projection.prepared import Guarantee, ProjectorState
from hemline.collide.projection.project import Projector
from hemline.collide.projection.project_frame import ProjectionReport
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.collide.surface.nearest_skin import NearestSkin
from hemline.collide.surface.posed_surface import PosedSurface

from .layer import Layer, LayerState

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody
    from hemline.garments import Garment

THICKNESS = 0.0015
"""Least distance of a displaced vertex to the garment beneath, equal to the gap of the projection [m]."""


@dataclass(frozen=True)
class LayersReport(ProjectionReport):
    """Results of one frame, summed over all pieces."""

    caught: Int[np.ndarray, " caught"]
    """Vertices that stay behind the cloth beneath because the body leaves no room in front of it, ascending."""
    layers_ms: float
    """Time that moving garments out of garments took [ms]."""


@dataclass(frozen=True)
class LayersState:
    """State of a layered projection: plain data, never changed in place."""

    pieces: tuple[ProjectorState, ...]
    """State of the projection of each piece out of the body."""
    layers: tuple[LayerState, ...]
    """State of each piece over each piece beneath, in the order of `LayeredProjector.layers`."""


@dataclass(frozen=True, eq=False)
class LayeredProjector:
    """Projects garments worn together, from the skin outwards. Make one with `LayeredProjector.prepare`.

    Attributes:
        on_body: All pieces on the body.
        bounds: First vertex of each piece, then the number of all vertices.
        projectors: Moves each piece out of the body.
        layers: Moves each piece out of each one beneath: one layer for the second piece, two for the third, and so on.
    """

    on_body: GarmentOnBody
    bounds: tuple[int, ...]
    projectors: tuple[Projector, ...]
    layers: tuple[tuple[Layer, ...], ...]

    @classmethod
    def prepare(
        cls,
        shaped: "ShapedBody",
        pieces: "tuple[Garment, ...]",
        on_body: GarmentOnBody,
        *,
        thickness: float = THICKNESS,
        guarantee: Guarantee = "exact",
        measure: bool = True,
        whole: tuple[bool, ...],
        cover: bool = True,
        detail: float = 1.0,
    ) -> Self:
        """Prepares the pieces.

        Args:
            shaped: The body.
            pieces: Garments from the skin outwards.
            on_body: All pieces on the body, in that order.
            thickness: See `Layer.prepare` [m].
            guarantee: See `Projector.prepare`.
            measure: See `Projector.prepare`.
            whole: For each piece, whether the whole-cloth step runs where another is beneath it.
            cover: See `Layer.prepare`.
            detail: See `Layer.prepare`.

        Raises:
            BadBody: A piece cannot be closed, see `Layer.prepare`.
        """
        bounds = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
        projectors = tuple(
            Projector.prepare(
                shaped,
                piece.vertices,
                piece.faces,
                guarantee=guarantee,
                measure=measure,
                on_body=GarmentOnBody.of(shaped, piece.vertices, patches=on_body.patches),
            )
            for piece in pieces
        )
        options = {"thickness": thickness, "guarantee": guarantee, "cover": cover, "detail": detail}
        layers = tuple(
            tuple(Layer.prepare(shaped, inner, outer, whole=whole[at], **options) for inner in pieces[:at])
            for at, outer in enumerate(pieces)
        )
        return cls(on_body, tuple(int(bound) for bound in bounds), projectors, layers)

    def start(self) -> LayersState:
        """Returns the state before the first frame."""
        over = tuple(layer.start() for layers in self.layers for layer in layers)
        return LayersState(tuple(projector.start() for projector in self.projectors), over)

    def project(
        self,
        state: LayersState,
        posed: "PosedBody",
        vertices: Vertices,
        *,
        dt: float,
        surface: PosedSurface | None = None,
        contact: NearestSkin | None = None,
    ) -> tuple[LayersState, Vertices, LayersReport]:
        """Moves each piece out of those beneath, which are in place already, and then out of the body.

        Args:
            state: State from `start`, or from the frame before; it is not changed.
            posed: The body in this frame.
            vertices: All pieces in this frame, any finite positions [m].
            dt: Time since the frame before [s].
            surface: The body's surface in this frame (`on_body.surface(posed)`), if it was computed already.
            contact: Where the skin is next to each vertex of all pieces, from a step before this one.

        Returns:
            The next state, the pieces [m], and a report. No vertex is inside the body but pinched ones; none is behind
            the cloth of a piece beneath it but those that the report names as caught.

        Raises:
            BadGarment: The number of vertices differs from the prepared garments', or a position is not finite.
        """
        vertices, surface = self.on_body.check_vertices(vertices), surface or self.on_body.surface(posed)
        over, frame = iter(state.layers), _FrameParts()
        for at, (low, high) in enumerate(pairwise(self.bounds)):
            began, piece, trials = time.perf_counter(), vertices[low:high], []
            for inner, layer in zip(frame.done, self.layers[at], strict=True):
                moved, piece, pinched = layer.step(next(over), posed, inner, piece, dt)
                frame.layers.append(moved)
                trials.append((layer, inner, piece, pinched))
            frame.seconds += time.perf_counter() - began
            near = None if contact is None else contact.part(low, high)
            after, out, report = self.projectors[at].project(
                state.pieces[at], posed, piece, dt=dt, surface=surface, contact=near
            )
            began = time.perf_counter()
            for layer, inner, before, pinched in trials:
                doubtful = np.union1d(pinched, np.flatnonzero((out != before).any(axis=1)))
                frame.caught.append(low + layer.behind(inner, out, doubtful))
            frame.seconds += time.perf_counter() - began
            frame.done.append(out)
            frame.states.append(after)
            frame.reports.append(report)
        after = LayersState(tuple(frame.states), tuple(frame.layers))
        return after, np.concatenate(frame.done), frame.report(self.bounds)


@dataclass
class _FrameParts:
    """Results of a frame, piece by piece."""

    done: list[Vertices] = field(default_factory=list)
    states: list[ProjectorState] = field(default_factory=list)
    layers: list[LayerState] = field(default_factory=list)
    reports: list[ProjectionReport] = field(default_factory=list)
    caught: list[np.ndarray] = field(default_factory=list)
    seconds: float = 0.0

    def report(self, bounds: tuple[int, ...]) -> LayersReport:
        """Returns the report of all pieces together."""
        each, none = self.reports, np.zeros(0, np.int32)
        return LayersReport(
            moved=sum(report.moved for report in each),
            deepest_mm=max(report.deepest_mm for report in each),
            pinched=np.concatenate([np.int32(low) + r.pinched for low, r in zip(bounds, each, strict=False)]),
            pinched_anchors=np.concatenate([report.pinched_anchors for report in each]),
            inside_before=sum(r.inside_before or 0 for r in each) if each[0].inside_before is not None else None,
            exact=all(report.exact for report in each),
            caught=np.unique(np.concatenate([none, *self.caught])).astype(np.int32),
            layers_ms=1e3 * self.seconds,
        )
