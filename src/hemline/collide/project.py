"""The final projection: no garment vertex inside the posed body, tested for every vertex in every frame.

After it every garment vertex has winding number 0 with respect to this frame's posed body mesh, except *pinched* ones:
their nearest place on their own limb, moved 2 mm outward, lies inside another part of the body, which cuts through
itself there. Those are kept outside of their own limb and reported.
"""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from hemline.arrays import Bool, Faces, Float, Int, Points, Vertices
from hemline.errors import BadGarment

from .patches import Patches, dominant_joints, make_patches, vertex_blocks
from .pushkernels import judge, list_tests, push, seek_places, settle
from .raykernels import BLOCK, GROUP, certify, into_frame, surface_boxes, windings

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

Guarantee = Literal["exact", "fast"]

PINCH_OFFSET = np.float32(0.002)
"""How far an anchor is moved outward before it is asked whether it lies inside another part [m]."""


@dataclass(frozen=True)
class ProjectionSettings:
    """Distances and times of the projection."""

    margin: float = 0.0045
    """Vertices nearer to the skin than this are moved outward [m]."""
    gap: float = 0.0015
    """No vertex that is pushed ends nearer to the skin than this [m]."""
    reach: float = 0.012
    """Vertices higher than this over the tangent plane of their anchor are left alone [m]."""
    release: float = 0.05
    """Time constant with which a displacement that is no longer needed fades [s]."""


@dataclass(frozen=True)
class ProjectorState:
    """What moves from frame to frame: plain arrays in the projector's own order of vertices; copy it to roll back."""

    frame: int
    """Frames done."""
    anchors: Int[np.ndarray, " verts"]
    """Nearest vertex of the body found last."""
    offsets: Float[np.ndarray, "verts 3"]
    """Displacement in the last frame, in the frame of the key bone [m]."""
    directions: Int[np.ndarray, " groups"]
    """The axis along which each group of vertices sees least of the body."""
    lively: Bool[np.ndarray, " blocks"]
    """Blocks in which a vertex was displaced."""


@dataclass(frozen=True)
class ProjectionReport:
    """What the projection did in one frame."""

    moved: int
    """Vertices moved."""
    deepest_mm: float
    """Distance to the skin of the deepest vertex before the projection; 0 if none was inside."""
    pinched: Int[np.ndarray, " pinched"]
    """Vertices that have no free place near, ascending."""
    pinched_anchors: Points
    """Their nearest places on their own limbs, moved 2 mm outward: each lies inside the body [m]."""
    inside_before: int | None
    """Vertices with a winding number other than 0 before the projection; None if not tested."""
    exact: bool
    """Whether every vertex was tested."""


@dataclass(frozen=True)
class Projector:
    """A garment and a body made ready for the projection; frozen. Make it with `Projector.prepare`."""

    patches: Patches
    order: Int[np.ndarray, " verts"]
    """The projector's order of vertices to the garment's."""
    home: Int[np.ndarray, " verts"]
    """Body vertex nearest to each garment vertex at rest, both renumbered."""
    key_joint: int
    """The bone in whose frame rays run."""
    guarantee: Guarantee
    settings: ProjectionSettings

    @staticmethod
    def prepare(
        shaped: "ShapedBody",
        garment_vertices_rest: Vertices,
        garment_faces: Faces,
        *,
        guarantee: Guarantee = "exact",
        settings: ProjectionSettings | None = None,
    ) -> "Projector":
        """Make a garment on a body ready: cut the body into patches, the garment into blocks.

        Args:
            shaped: The body.
            garment_vertices_rest: The garment at rest, in the world of the body's rest pose [m].
            garment_faces: Its triangles.
            guarantee: `exact` tests every vertex in every frame; `fast` only pushes, and reports inside as unknown.
            settings: Distances and times.

        Raises:
            BadBody: The body's mesh is not closed.
            BadGarment: The garment is empty or not finite.
        """
        from scipy.spatial import cKDTree

        rest = np.asarray(garment_vertices_rest, np.float32).reshape(-1, 3)
        if not len(rest) or not np.isfinite(rest).all():
            raise BadGarment("the projection needs a garment", f"{len(rest)} vertices, not all finite", "give a mesh")
        patches = make_patches(shaped)
        order = vertex_blocks(rest, BLOCK)
        home = cKDTree(shaped.vertices[patches.order]).query(rest[order])[1]
        joints = dominant_joints(shaped.body.weight_indices, shaped.body.weights)[patches.order[home]]
        return Projector(
            patches=patches,
            order=order.astype(np.int32),
            home=home.astype(np.int32),
            key_joint=int(np.bincount(joints).argmax()),
            guarantee=guarantee,
            settings=settings or ProjectionSettings(),
        )

    def start(self) -> ProjectorState:
        """The state before the first frame."""
        count = len(self.order)
        return ProjectorState(
            frame=0,
            anchors=self.home.copy(),
            offsets=np.zeros((count, 3), np.float32),
            directions=np.zeros(-(-count // GROUP), np.int8),
            lively=np.zeros(-(-count // BLOCK), np.bool_),
        )

    def project(
        self, state: ProjectorState, posed: "PosedBody", vertices: Vertices, *, dt: float
    ) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        """Move the vertices of one frame out of the posed body.

        Args:
            state: From `start`, or from the frame before.
            posed: The body in this frame.
            vertices: The garment in this frame, any finite positions [m].
            dt: Time since the frame before [s].

        Returns:
            The next state, the vertices outside of the body, and what was done.

        Raises:
            BadGarment: Another number of vertices than was prepared, or positions that are not finite.
        """
        vertices = np.ascontiguousarray(vertices, np.float32)
        if vertices.shape != (len(self.order), 3):
            raise BadGarment(
                "the projection was prepared for another garment",
                f"vertices {vertices.shape}, not {(len(self.order), 3)}",
                "prepare a projector for this garment",
            )
        if not np.isfinite(vertices).all():
            raise BadGarment("garment vertices must be finite", "NaN or infinity", "look at what made this frame")
        return _Frame(self, state, posed, vertices).projected(dt)


class _Frame:
    """One frame's arrays on their way through the stages."""

    def __init__(self, projector: Projector, state: ProjectorState, posed: "PosedBody", vertices: Vertices):
        self.projector, self.vertices = projector, vertices
        self.settings, patches = projector.settings, projector.patches
        self.to_world = np.ascontiguousarray(posed.transforms[projector.key_joint], np.float32)
        turn = self.to_world[:, :3].T
        to_bone = np.ascontiguousarray(np.concatenate([turn, -turn @ self.to_world[:, 3:]], axis=1))
        self.body = np.empty((len(patches.order), 3), np.float32)
        self.points = np.empty_like(vertices)
        into_frame(to_bone, posed.vertices, patches.order, self.body)
        into_frame(to_bone, vertices, projector.order, self.points)
        self.leaf_box = np.empty((6, len(patches.leaf_start) - 1), np.float32)
        self.patch_box = np.empty((6, len(patches.patch_start) - 1), np.float32)
        surface_boxes(
            self.body, patches.leaf_start, patches.leaf_vertices, patches.patch_start, self.leaf_box, self.patch_box
        )
        self.known, self.normals = np.zeros(len(self.body), np.bool_), np.empty_like(self.body)
        self.corners = np.empty((len(patches.leaf_start) - 1, 9, 8), np.float32)
        self.state = replace(
            state, frame=state.frame + 1, anchors=state.anchors.copy(), directions=state.directions.copy()
        )

    def projected(self, dt: float) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        state, settings = self.state, self.settings
        near = np.empty(len(self.points), np.int32)
        tries = 5 if state.frame == 1 else 1
        count = certify(
            self.points, self.patch_box, state.lively, np.float32(0.005), state.frame, tries, state.directions, near
        )
        ids = near[:count]
        pushed, signed = np.empty((count, 3), np.float32), np.empty(count, np.float32)
        decay = np.float32(np.exp(-dt / settings.release))
        patches = self.projector.patches
        push(
            self.points, ids, self.body, patches.ring_start, patches.ring, self.known, self.normals, state.anchors,
            state.offsets, decay, np.float32(settings.margin), np.float32(settings.gap), np.float32(settings.reach),
            pushed, signed,
        )  # fmt: skip
        if self.projector.guarantee == "exact":
            inside, pinched, anchors = self.repaired(ids, pushed, signed)
            inside_before, deepest = int(inside.sum()), signed[inside]
        else:
            pinched, anchors = np.empty(0, np.int32), np.empty((0, 3), np.float32)
            inside_before, deepest = None, signed[signed < 0]
        offsets, lively, out = np.empty_like(state.offsets), np.empty_like(state.lively), self.vertices.copy()
        moved = settle(self.points, ids, pushed, offsets, lively, self.to_world, self.projector.order, out)
        report = ProjectionReport(
            moved=moved,
            deepest_mm=float(np.abs(deepest).max(initial=0)) * 1000,
            pinched=pinched,
            pinched_anchors=anchors,
            inside_before=inside_before,
            exact=self.projector.guarantee == "exact",
        )
        return replace(state, offsets=offsets, lively=lively), out, report

    def windings(self, tests: Points, group: Int[np.ndarray, " tests"]) -> Int[np.ndarray, " tests"]:
        winding, patches = np.empty(len(tests), np.int32), self.projector.patches
        windings(
            tests, group, self.state.directions, self.body, patches.faces, self.leaf_box, patches.patch_start,
            self.patch_box, self.corners, winding,
        )  # fmt: skip
        return winding

    def repaired(self, ids: Int[np.ndarray, " near"], pushed: Points, signed: Float[np.ndarray, " near"]):
        count = len(ids)
        tests, group = np.empty((2 * count, 3), np.float32), np.empty(2 * count, np.int32)
        after, bad = np.empty(count, np.int32), np.empty(count, np.int32)
        inside, keep = np.empty(count, np.bool_), np.empty(count, np.bool_)
        used = list_tests(self.points, ids, pushed, GROUP, tests, group, after)
        winding = self.windings(tests[:used], group[:used])
        bad_count = judge(signed, winding, after, np.float32(self.settings.margin), inside, keep, bad)
        pushed[keep] = self.points[ids[keep]]
        pinched, anchors = self.relocated(ids, bad[:bad_count], pushed, signed)
        return inside, pinched, anchors

    def relocated(self, ids, bad, pushed, signed):
        anchors, places = self.sought(ids[bad], np.full(len(bad), -1, np.int32))
        rise = self.lifted(-np.abs(places[:, 6]))
        candidates = places[:, :3] + rise[:, None] * places[:, 3:6]
        free = self.windings(candidates, ids[bad] // GROUP) == 0
        signed[bad] = places[:, 6]
        pushed[bad[free]] = candidates[free]
        self.state.anchors[ids[bad[free]]] = anchors[free]
        bad = bad[~free]
        home = self.projector.patches.limb[self.projector.home[ids[bad]]]
        anchors, places = self.sought(ids[bad], home)
        candidates = places[:, :3] + PINCH_OFFSET * places[:, 3:6]
        free = self.windings(candidates, ids[bad] // GROUP) == 0
        kept = np.where(
            (places[:, 6] < self.settings.margin)[:, None],
            places[:, :3] + self.lifted(places[:, 6])[:, None] * places[:, 3:6],
            self.points[ids[bad]],
        )
        pushed[bad] = np.where(free[:, None], candidates, kept)
        self.state.anchors[ids[bad]] = anchors
        vertices = self.projector.order[ids[bad[~free]]]
        rank = np.argsort(vertices)
        world = candidates[~free] @ self.to_world[:, :3].T + self.to_world[:, 3]
        return vertices[rank], world[rank].astype(np.float32)

    def sought(self, ids, limb):
        patches = self.projector.patches
        anchors, places = np.empty(len(ids), np.int32), np.empty((len(ids), 7), np.float32)
        seek_places(
            self.points, ids, limb, self.body, patches.leaf_start, patches.leaf_vertices, patches.patch_start,
            self.patch_box, patches.patch_limb, patches.ring_start, patches.ring, self.known, self.normals, anchors,
            places,
        )  # fmt: skip
        return anchors, places

    def lifted(self, distance):
        room = np.float32(self.settings.margin - self.settings.gap)
        low = np.minimum(distance, np.float32(self.settings.margin))
        return np.float32(self.settings.gap) + room * room / (room + np.float32(self.settings.margin) - low)
