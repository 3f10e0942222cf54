"""One frame of the projection: the arrays of a frame, and the stages that they pass through."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Bool, Float, Int, Points, Vertices
from hemline.collide.surface.box_kernels import BLOCK
from hemline.collide.surface.nearest_skin import NearestSkin
from hemline.collide.surface.posed_surface import PosedSurface
from hemline.collide.surface.surface_kernels import MOST_STEPS

from .cloth import Cloth, Escapes, LeafCorners, LiftDistances, Proposal
from .displace_kernels import SLOW_STEPS, displace, list_doubtful, restore_free, write_back
from .escape_kernels import deepest_penetration, find_escape_faces, propose_escapes, take_escapes
from .pinch_kernels import carry_along
from .prepared import PreparedProjection, ProjectorState
from .ray_kernels import certify, windings

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

LONGEST_WAY = 0.015
"""A vertex that a step before has kept over its own skin is not moved farther than this, but counts as pinched: its
neighbours were kept over the same skin [m]."""
ROUNDING_UNITS = 16
"""Rounding of a point that goes into the bone's frame and back, in units of its last place there."""


@dataclass(frozen=True)
class ProjectionReport:
    """Results of the projection in one frame."""

    moved: int
    """Number of vertices moved."""
    deepest_mm: float
    """Distance to the skin of the deepest vertex before the projection; 0 if none was inside, NaN if not measured."""
    pinched: Int[np.ndarray, " pinched"]
    """Vertices that have no free place near, ascending."""
    pinched_anchors: Points
    """Nearest places of the pinched vertices on their own limbs, moved 2 mm outward: the winding number is not 0 there
    [m]."""
    inside_before: int | None
    """Vertices inside the body, with a winding number above 0.5, before the projection; None if not measured."""
    exact: bool
    """Whether every vertex was tested."""


class ProjectedFrame:
    """Body and garment of one frame in the frame of the key bone; one method for each stage."""

    def __init__(
        self,
        projector: PreparedProjection,
        state: ProjectorState,
        posed: "PosedBody",
        vertices: Vertices,
        places: Int[np.ndarray, " verts"] | None = None,
        surface: PosedSurface | None = None,
        contact: NearestSkin | None = None,
    ):
        self.projector, self.patches, self.vertices = projector, projector.on_body.patches, vertices
        settings = projector.settings
        self.distances = LiftDistances(*map(np.float32, (settings.margin, settings.gap, settings.far)))
        surface = surface or projector.on_body.surface(posed)
        self.to_world, self.skin = surface.to_world, surface.skin
        self.points = surface.into_bone_frame(vertices, projector.on_body.order)
        leaves = self.skin.leaf_box.shape[1]
        self.leaves = LeafCorners(np.empty((leaves, 10, BLOCK), np.float32), np.zeros(leaves, np.bool_))
        reach = float(np.abs(self.skin.patch_box).max())
        far = float(np.abs(self.to_world[:, 3]).max()) + reach
        self.rounding = np.float32(np.finfo(np.float32).eps * (ROUNDING_UNITS * reach + 2 * far))
        self.state = replace(
            state,
            frame=state.frame + 1,
            anchors=state.anchors.copy(),
            heights=state.heights.copy(),
            directions=state.directions.copy(),
            hidden=state.hidden.copy(),
            offsets=state.offsets.copy(),
        )
        self.held, self.given_up = np.zeros(len(self.points), np.bool_), np.zeros(len(self.points), np.bool_)
        if contact is not None:
            self.start_from(contact)
        self.in_contact, self.places = places is not None, np.full(len(self.points), -1, np.int64)
        if places is not None:
            corners = posed.shaped.body.faces[places[projector.on_body.order], 0]
            given = places[projector.on_body.order] >= 0
            self.places[given] = self.patches.ring[self.patches.ring_start[self.patches.number[corners[given]]]]
        self.cloth = Cloth(self.points, self.places, self.state.anchors, self.state.heights, self.state.offsets)

    def start_from(self, contact: NearestSkin) -> None:
        """Forgets, for each vertex with a known place on the skin, where it was kept in earlier frames.

        The height there may be that over a plane, while other skin is nearer, so such a vertex is measured in every
        frame: measured in some only, it would flicker on a body that stands still.
        """
        order, state = self.projector.on_body.order, self.state
        faces = contact.faces[order]
        known = faces >= 0
        self.held, self.given_up = known, contact.pinched[order]
        state.anchors[known] = faces[known]
        state.heights[known] = np.minimum(contact.heights[order][known], 2 * self.distances.margin)
        state.offsets[known] = 0

    def project(self, dt: float) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        """Runs all stages; returns the next state, the garment outside of the body [m], and the report.

        Args:
            dt: Time since the frame before [s].
        """
        exact = self.projector.guarantee == "exact"
        ids = self.vertices_near_skin()
        positions, signed = self.displace_vertices(ids, dt)
        order, pinched, anchors = self.projector.on_body.order, np.empty(0, np.int32), np.empty((0, 3), np.float32)
        if exact:
            blocked = self.find_blocked(ids, positions, signed)
            if len(blocked):
                pinched, anchors = self.lead_out(ids, blocked, positions, signed)
        offsets, displaced = np.empty_like(self.state.offsets), np.empty_like(self.state.lively)
        out = self.vertices.copy()
        moved = write_back(self.points, ids, positions, self.to_world, order, offsets, displaced, out)
        if not self.in_contact:
            self.move_pinched(pinched, offsets, out)
        before, depth = self.penetration(ids, signed) if self.projector.measure else (None, float("nan"))
        report = ProjectionReport(moved, 1000 * depth, order[pinched], anchors, before, exact)
        return replace(self.state, offsets=offsets, lively=displaced), out, report

    def move_pinched(self, pinched: Int[np.ndarray, " pinched"], offsets: Points, out: Vertices) -> None:
        """Moves pinched vertices along with their neighbours that are not pinched, as far as cloth links them.

        If each were led out by itself, neighbours between two limbs that cut through each other would be torn apart.
        This is skipped where contact holds vertices off, as in a simulation, which handles what pinches them.
        """
        starts, turn, origin = self.projector.starts, self.to_world[:, :3], self.to_world[:, 3]
        linked = pinched[starts[pinched + 1] > starts[pinched]]
        carry_along(linked, starts, self.projector.neighbours, offsets)
        out[self.projector.on_body.order[linked]] = (self.points[linked] + offsets[linked]) @ turn.T + origin

    def vertices_near_skin(self) -> Int[np.ndarray, " near"]:
        """Returns the vertices that boxes alone cannot show to be outside, or that were displaced in the last frame."""
        near, state = np.empty(len(self.points), np.int32), self.state
        tries = 5 if state.frame == 1 else 1
        count = certify(
            self.points,
            self.skin.patch_box,
            state.lively,
            state.frame,
            tries,
            state.directions,
            state.hidden,
            near,
        )
        return near[:count]

    def displace_vertices(self, ids: Int[np.ndarray, " near"], dt: float) -> tuple[Points, Float[np.ndarray, " near"]]:
        """Returns where each vertex should go by its anchor, and its signed distance before [m]."""
        positions, signed = np.empty((len(ids), 3), np.float32), np.empty(len(ids), np.float32)
        decay = np.float32(np.exp(-dt / self.projector.settings.release))
        displace(self.cloth, self.skin, ids, decay, self.distances, self.state.frame, positions, signed)
        return positions, signed

    def find_blocked(
        self, ids: Int[np.ndarray, " near"], positions: Points, signed: Float[np.ndarray, " near"]
    ) -> Int[np.ndarray, " blocked"]:
        """Returns which vertices are free neither where they were nor at their new position.

        A vertex that was free before is put back, and so is one that would go farther than `LONGEST_WAY` or that was
        given up in a step before, which count as blocked: `positions` is changed.
        """
        count, state = len(ids), self.state
        doubtful, blocked, tests = (
            np.empty(count, np.int32),
            np.empty(count, np.int32),
            np.empty((count, 3), np.float32),
        )
        proposal = Proposal(positions, signed, *self.windings(positions, ids))
        listed = list_doubtful(
            self.points, state.offsets, ids, proposal, self.distances.margin, state.frame, doubtful, tests
        )
        winding, touching = self.windings(tests[:listed], ids[doubtful[:listed]])
        blocked_count = restore_free(self.points, ids, proposal, doubtful[:listed], winding, touching, blocked)
        return np.union1d(blocked[:blocked_count], self.put_back(ids, positions))

    def put_back(self, ids: Int[np.ndarray, " near"], positions: Points) -> Int[np.ndarray, " back"]:
        """Puts vertices back that were given up or would go farther than `LONGEST_WAY`; returns which.

        `positions` is changed.
        """
        ways = positions - self.points[ids]
        square = np.einsum("ij,ij->i", ways, ways)
        far = self.held[ids] & (square > LONGEST_WAY**2)
        back = np.flatnonzero(far | self.given_up[ids] & (square > 0)).astype(np.int32)
        positions[back] = self.points[ids[back]]
        return back

    def penetration(
        self, ids: Int[np.ndarray, " near"], signed: Float[np.ndarray, " near"]
    ) -> tuple[int | None, float]:
        """Returns the number of vertices inside before the projection, and the depth of the deepest [m].

        The number is None where vertices are not tested.
        """
        exact = self.projector.guarantee == "exact"
        inside = self.windings(self.points[ids], ids)[0] > 0.5 if exact else signed < 0
        depth = deepest_penetration(self.points, self.state.anchors, self.skin, ids, inside, signed)
        return int(np.count_nonzero(inside)) if exact else None, depth

    def windings(
        self, tests: Points, ids: Int[np.ndarray, " tests"]
    ) -> tuple[Int[np.ndarray, " tests"], Bool[np.ndarray, " tests"]]:
        """Returns winding numbers of points of vertices, and whether each point is within rounding of the skin.

        Args:
            tests: The points, in the frame of the key bone [m].
            ids: The vertex of each point, ascending.
        """
        winding, touching = np.empty(len(tests), np.int32), np.empty(len(tests), np.bool_)
        windings(tests, ids, self.state.directions, self.skin, self.rounding, self.leaves, winding, touching)
        return winding, touching

    def lead_out(
        self,
        ids: Int[np.ndarray, " near"],
        blocked: Int[np.ndarray, " blocked"],
        positions: Points,
        signed: Float[np.ndarray, " near"],
    ) -> tuple[Int[np.ndarray, " pinched"], Float[np.ndarray, "pinched 3"]]:
        """Leads blocked vertices out, and returns those that remain: the pinched ones.

        A vertex with a place of contact goes out over that place; another one over the nearest skin, else over the
        nearest skin of its own limb. Pinched vertices come by their numbers in the garment's order, with their anchors
        in the world [m].
        """
        has_place = self.places[ids[blocked]] >= 0
        kept, free = blocked[has_place], blocked[~has_place]
        faces, where = np.empty((len(free), 2), np.int64), np.empty((0, 3), np.float32)
        at_kept = where
        if len(kept):
            still, at_kept = self.try_escape(ids, kept, positions, signed, self.places[ids[kept]], SLOW_STEPS)
            kept = kept[still]
            # contact goes on holding these off; led out of one part, they would only be deeper in another
            positions[kept] = self.points[ids[kept]]
        limb, anchors = self.projector.on_body.limb, self.state.anchors
        find_escape_faces(self.points, anchors, self.skin, ids, free, limb, faces)
        for own_limb in (False, True):
            around = np.ascontiguousarray(faces[:, int(own_limb)])
            still, where = self.try_escape(ids, free, positions, signed, around, MOST_STEPS, own_limb=own_limb)
            free, faces = free[still], faces[still]
        pinched = ids[np.concatenate([kept, free])]
        rank = np.argsort(self.projector.on_body.order[pinched])
        where = np.concatenate([at_kept, where])[rank]
        return pinched[rank], where @ self.to_world[:, :3].T + self.to_world[:, 3]

    def try_escape(
        self,
        ids: Int[np.ndarray, " near"],
        blocked: Int[np.ndarray, " blocked"],
        positions: Points,
        signed: Float[np.ndarray, " near"],
        faces: Int[np.ndarray, " blocked"],
        most_steps: int,
        *,
        own_limb: bool = False,
    ) -> tuple[Int[np.ndarray, " still"], Float[np.ndarray, "still 3"]]:
        """Tries a way out around a face for each vertex; returns which of `blocked` are still not free, and where."""
        escapes = Escapes(np.empty((len(blocked), 3), np.float32), np.empty((len(blocked), 3), np.float32))
        vertices = ids[blocked]
        propose_escapes(self.cloth, self.skin, vertices, faces, most_steps, own_limb, self.distances, escapes)
        if not own_limb:
            signed[blocked] = self.state.heights[vertices]
        winding, touching = self.windings(escapes.trials, vertices)
        ways = np.linalg.norm(escapes.trials - self.points[vertices], axis=1)
        touching |= self.held[vertices] & (ways > LONGEST_WAY) | self.given_up[vertices]
        still = np.empty(len(blocked), np.int32)
        still = still[: take_escapes(blocked, winding, touching, escapes, positions, still)]
        return still, escapes.trials[still]
