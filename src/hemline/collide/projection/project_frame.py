"""One frame of the projection: its arrays on their way through the stages."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Bool, Float, Int, Points, Vertices
from hemline.collide.surface.box_kernels import BLOCK
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.collide.surface.surface_kernels import MOST_STEPS

from .displace_kernels import SLOW_STEPS, displace, restore_free, list_doubtful, write_back
from .pinch_kernels import carry_along
from .prepared import PreparedProjection, ProjectorState
from .ray_kernels import certify, windings
from .escape_kernels import deepest_penetration, propose_escapes, find_escape_faces, take_escapes

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

PINCH_OFFSET = np.float32(0.002)
"""How far an anchor is moved outward before it is asked whether it lies inside another part [m]."""
SKYLINE_MARGIN = np.float32(0.005)
"""How much the boxes of the body are widened before vertices are certified to be free of them [m]."""

TURNS = 16
"""Rounding of a point that goes into the bone's frame and back, in units of its last place there."""


@dataclass(frozen=True)
class ProjectionReport:
    """What the projection did in one frame."""

    moved: int
    """Vertices moved."""
    deepest_mm: float
    """Distance to the skin of the deepest vertex before the projection; 0 if none was inside, NaN if not measured."""
    pinched: Int[np.ndarray, " pinched"]
    """Vertices that have no free place near, ascending."""
    pinched_anchors: Points
    """Their nearest places on their own limbs, moved 2 mm outward: the winding number is not 0 there [m]."""
    inside_before: int | None
    """Vertices inside the body, with a winding number above 0.5, before the projection; None if not measured."""
    exact: bool
    """Whether every vertex was tested."""


class ProjectedFrame:
    """Body and garment in the frame of the key bone, and what the stages find out about them."""

    def __init__(
        self,
        projector: PreparedProjection,
        state: ProjectorState,
        posed: "PosedBody",
        vertices: Vertices,
        places: Int[np.ndarray, " verts"] | None = None,
        surface: PosedSurface | None = None,
    ):
        self.projector, self.patches, self.vertices = projector, projector.on_body.patches, vertices
        self.margin, self.gap = np.float32(projector.settings.margin), np.float32(projector.settings.gap)
        surface = surface or projector.on_body.surface(posed)
        self.to_world, self.skin = surface.to_world, surface.skin
        self.points = surface.into_bone_frame(vertices, projector.on_body.order)
        leaves = self.skin.leaf_box.shape[1]
        self.corners, self.gathered = np.empty((leaves, 10, BLOCK), np.float32), np.zeros(leaves, np.bool_)
        reach = float(np.abs(self.skin.patch_box).max())
        far = float(np.abs(self.to_world[:, 3]).max()) + reach
        self.rounding = np.float32(np.finfo(np.float32).eps * (TURNS * reach + 2 * far))
        self.state = replace(
            state,
            frame=state.frame + 1,
            anchors=state.anchors.copy(),
            heights=state.heights.copy(),
            directions=state.directions.copy(),
            hidden=state.hidden.copy(),
        )
        self.held, self.places = places is not None, np.full(len(self.points), -1, np.int64)
        if places is not None:
            corners = posed.shaped.body.faces[places[projector.on_body.order], 0]
            held = places[projector.on_body.order] >= 0
            self.places[held] = self.patches.ring[self.patches.ring_start[self.patches.number[corners[held]]]]

    def project(self, dt: float) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        """The next state, the garment outside of the body, and the report."""
        exact = self.projector.guarantee == "exact"
        ids = self.vertices_near_skin()
        displaced, signed = self.displace_vertices(ids, dt)
        order, pinched, anchors = self.projector.on_body.order, np.empty(0, np.int32), np.empty((0, 3), np.float32)
        if exact:
            bad = self.find_blocked(ids, displaced, signed)
            if len(bad):
                pinched, anchors = self.lead_out(ids, bad, displaced, signed)
        offsets, lively = np.empty_like(self.state.offsets), np.empty_like(self.state.lively)
        out = self.vertices.copy()
        moved = write_back(self.points, ids, displaced, self.to_world, order, offsets, lively, out)
        if not self.held:
            self.move_pinched(pinched, offsets, out)
        before, depth = self.penetration(ids, signed) if self.projector.measure else (None, float("nan"))
        report = ProjectionReport(moved, 1000 * depth, order[pinched], anchors, before, exact)
        return replace(self.state, offsets=offsets, lively=lively), out, report

    def move_pinched(self, pinched: Int[np.ndarray, " pinched"], offsets: Points, out: Vertices) -> None:
        """Let pinched vertices go along with those around them, which are not, as far as cloth links them.

        Led out each by itself, neighbours of two limbs that cut through each other are torn apart. Not done where
        contact holds vertices off, as in a simulation: it goes on with what pinches them.
        """
        starts, turn, origin = self.projector.starts, self.to_world[:, :3], self.to_world[:, 3]
        linked = pinched[starts[pinched + 1] > starts[pinched]]
        carry_along(linked, starts, self.projector.neighbours, offsets)
        out[self.projector.on_body.order[linked]] = (self.points[linked] + offsets[linked]) @ turn.T + origin

    def vertices_near_skin(self) -> Int[np.ndarray, " near"]:
        """Vertices that boxes alone cannot show to be outside, or that were displaced in the last frame."""
        near, state = np.empty(len(self.points), np.int32), self.state
        tries = 5 if state.frame == 1 else 1
        count = certify(
            self.points,
            self.skin.patch_box,
            state.lively,
            SKYLINE_MARGIN,
            state.frame,
            tries,
            state.directions,
            state.hidden,
            near,
        )
        return near[:count]

    def displace_vertices(self, ids: Int[np.ndarray, " near"], dt: float) -> tuple[Points, Float[np.ndarray, " near"]]:
        """Where each vertex should go by its anchor, and its signed distance before."""
        displaced, signed = np.empty((len(ids), 3), np.float32), np.empty(len(ids), np.float32)
        settings, state = self.projector.settings, self.state
        decay, far = np.float32(np.exp(-dt / settings.release)), np.float32(settings.far)
        displace(
            self.points,
            ids,
            self.skin,
            self.places,
            state.anchors,
            state.heights,
            state.offsets,
            decay,
            self.margin,
            self.gap,
            far,
            state.frame,
            displaced,
            signed,
        )
        return displaced, signed

    def find_blocked(
        self, ids: Int[np.ndarray, " near"], displaced: Points, signed: Float[np.ndarray, " near"]
    ) -> Int[np.ndarray, " bad"]:
        """Which vertices are free neither where they were nor where they go; what was free before stays there."""
        count, state = len(ids), self.state
        doubtful, bad, tests = np.empty(count, np.int32), np.empty(count, np.int32), np.empty((count, 3), np.float32)
        winding, near = self.windings(displaced, ids)
        asked = list_doubtful(
            self.points, ids, displaced, signed, winding, near, state.offsets, self.margin, state.frame, doubtful, tests
        )
        before, near_before = self.windings(tests[:asked], ids[doubtful[:asked]])
        bad_count = restore_free(self.points, ids, winding, near, doubtful[:asked], before, near_before, displaced, bad)
        return bad[:bad_count]

    def penetration(self, ids: Int[np.ndarray, " near"], signed: Float[np.ndarray, " near"]) -> tuple[int | None, float]:
        """Vertices inside before the projection (None: not tested), and distance to the skin of the deepest [m]."""
        exact = self.projector.guarantee == "exact"
        inside = self.windings(self.points[ids], ids)[0] > 0.5 if exact else signed < 0
        depth = deepest_penetration(self.points, ids, inside, signed, self.state.anchors, self.skin)
        return int(np.count_nonzero(inside)) if exact else None, depth

    def windings(
        self, tests: Points, ids: Int[np.ndarray, " tests"]
    ) -> tuple[Int[np.ndarray, " tests"], Bool[np.ndarray, " tests"]]:
        """Winding numbers of points that belong to vertices, ascending; and which are within rounding of the skin."""
        winding, near = np.empty(len(tests), np.int32), np.empty(len(tests), np.bool_)
        windings(
            tests,
            ids,
            self.state.directions,
            self.skin,
            self.rounding,
            self.corners,
            self.gathered,
            winding,
            near,
        )
        return winding, near

    def lead_out(
        self,
        ids: Int[np.ndarray, " near"],
        bad: Int[np.ndarray, " bad"],
        displaced: Points,
        signed: Float[np.ndarray, " near"],
    ) -> tuple[Int[np.ndarray, " pinched"], Float[np.ndarray, "pinched 3"]]:
        """Lead vertices out over the places that they have; the others by the nearest skin, else by that of their own
        limb. What is left is pinched: returned in the projector's order, by their numbers in the garment.
        """
        held = self.places[ids[bad]] >= 0
        kept, free = bad[held], bad[~held]
        faces, where = np.empty((len(free), 2), np.int64), np.empty((0, 3), np.float32)
        at_kept = where
        if len(kept):
            still, at_kept = self.try_escape(ids, kept, displaced, signed, self.places[ids[kept]], SLOW_STEPS)
            kept = kept[still]
            # contact goes on holding these off; led out of one part, they would only be deeper in another
            displaced[kept] = self.points[ids[kept]]
        find_escape_faces(self.points, ids, free, self.projector.on_body.limb, self.skin, self.state.anchors, faces)
        for own_limb in (False, True):
            around = np.ascontiguousarray(faces[:, int(own_limb)])
            still, where = self.try_escape(ids, free, displaced, signed, around, MOST_STEPS, own_limb=own_limb)
            free, faces = free[still], faces[still]
        pinched = ids[np.concatenate([kept, free])]
        rank = np.argsort(self.projector.on_body.order[pinched])
        where = np.concatenate([at_kept, where])[rank]
        return pinched[rank], where @ self.to_world[:, :3].T + self.to_world[:, 3]

    def try_escape(
        self,
        ids: Int[np.ndarray, " near"],
        bad: Int[np.ndarray, " bad"],
        displaced: Points,
        signed: Float[np.ndarray, " near"],
        faces: Int[np.ndarray, " bad"],
        most_steps: int,
        *,
        own_limb: bool = False,
    ) -> tuple[Int[np.ndarray, " still"], Float[np.ndarray, "still 3"]]:
        """Try a way out for each vertex, around a face; which of `bad` are not free, and where."""
        trial, otherwise = np.empty((len(bad), 3), np.float32), np.empty((len(bad), 3), np.float32)
        propose_escapes(
            self.points,
            ids,
            bad,
            faces,
            most_steps,
            own_limb,
            PINCH_OFFSET,
            self.margin,
            self.gap,
            self.skin,
            self.state.anchors,
            self.state.heights,
            signed,
            trial,
            otherwise,
        )
        winding, near = self.windings(trial, ids[bad])
        still = np.empty(len(bad), np.int32)
        still = still[: take_escapes(bad, winding, near, trial, otherwise, displaced, still)]
        return still, trial[still]
