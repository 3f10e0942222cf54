"""The final projection: no garment vertex inside the posed body, tested for every vertex in every frame.

After it every garment vertex has winding number 0 with respect to this frame's posed body mesh, except *pinched* ones:
their nearest place on their own limb, moved 2 mm outward, lies inside another part of the body, which cuts through
itself there. Those are kept outside of their own limb and reported.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from hemline.arrays import Bool, Faces, Float, Int, Points, UInt, Vertices
from hemline.errors import BadGarment

from .patches import Patches, dominant_joints, make_patches, vertex_blocks
from .ray_kernels import BLOCK, GROUP

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

Guarantee = Literal["exact", "fast"]


@dataclass(frozen=True)
class ProjectionSettings:
    """Distances and times of the projection."""

    margin: float = 0.0045
    """Vertices nearer to the skin than this are moved outward [m]."""
    gap: float = 0.0015
    """No vertex that is pushed ends nearer to the skin than this [m]."""
    far: float = 0.02
    """Vertices that were farther outside than this are tested, but looked at only in every fourth frame [m]."""
    release: float = 0.05
    """Time constant with which a displacement that is no longer needed fades [s]."""


@dataclass(frozen=True)
class ProjectorState:
    """What moves from frame to frame: plain arrays in the projector's own order of vertices; copy it to roll back."""

    frame: int
    """Frames done."""
    anchors: Int[np.ndarray, " verts"]
    """The face of the body found nearest last."""
    heights: Float[np.ndarray, " verts"]
    """Signed distance when last measured [m]."""
    offsets: Float[np.ndarray, "verts 3"]
    """Displacement in the last frame, in the frame of the key bone [m]."""
    directions: Int[np.ndarray, " groups"]
    """The axis along which each group of vertices sees least of the body."""
    hidden: UInt[np.ndarray, " groups"]
    """1 for groups of which no vertex could be certified by boxes, uint8."""
    lively: Bool[np.ndarray, " blocks"]
    """Blocks in which a vertex was displaced."""


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
    """Their nearest places on their own limbs, moved 2 mm outward: each lies inside the body [m]."""
    inside_before: int | None
    """Vertices with a winding number other than 0 before the projection; None if not measured."""
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
    limb: Int[np.ndarray, " verts"]
    """The limb that each garment vertex belongs to: that of its home."""
    key_joint: int
    """The bone in whose frame rays run."""
    guarantee: Guarantee
    settings: ProjectionSettings
    measure: bool
    """Whether reports say how many vertices were inside before, and how deep; it changes nothing else."""

    @staticmethod
    def prepare(
        shaped: "ShapedBody",
        garment_vertices_rest: Vertices,
        garment_faces: Faces,
        *,
        guarantee: Guarantee = "exact",
        settings: ProjectionSettings | None = None,
        measure: bool = True,
    ) -> "Projector":
        """Make a garment on a body ready: cut the body into patches, the garment into blocks.

        Args:
            shaped: The body.
            garment_vertices_rest: The garment at rest, in the world of the body's rest pose [m].
            garment_faces: Its triangles.
            guarantee: `exact` tests every vertex in every frame; `fast` only pushes, and reports inside as unknown.
            settings: Distances and times.
            measure: Report how many vertices were inside before, and how deep: costs a test more of each vertex near.

        Raises:
            BadBody: The body's mesh is not closed.
            BadGarment: The garment is empty or not finite.
        """
        from scipy.spatial import KDTree

        rest = np.asarray(garment_vertices_rest, np.float32).reshape(-1, 3)
        if not len(rest) or not np.isfinite(rest).all():
            raise BadGarment("the projection needs a garment", f"{len(rest)} vertices, not all finite", "give a mesh")
        patches = make_patches(shaped)
        order = vertex_blocks(rest, BLOCK)
        home = np.asarray(KDTree(shaped.vertices[patches.order]).query(rest[order])[1])
        joints = dominant_joints(shaped.body.weight_indices, shaped.body.weights)[patches.order[home]]
        return Projector(
            patches=patches,
            order=order.astype(np.int32),
            home=home.astype(np.int32),
            limb=patches.limb[home],
            key_joint=int(np.bincount(joints).argmax()),
            guarantee=guarantee,
            settings=settings or ProjectionSettings(),
            measure=measure,
        )

    def start(self) -> ProjectorState:
        """The state before the first frame."""
        count = len(self.order)
        return ProjectorState(
            frame=0,
            anchors=self.patches.ring[self.patches.ring_start[self.home]],
            heights=np.zeros(count, np.float32),
            offsets=np.zeros((count, 3), np.float32),
            directions=np.zeros(-(-count // GROUP), np.int8),
            hidden=np.zeros(-(-count // GROUP), np.uint8),
            lively=np.zeros(-(-count // BLOCK), np.bool_),
        )

    def project(
        self,
        state: ProjectorState,
        posed: "PosedBody",
        vertices: Vertices,
        *,
        dt: float,
        places: Int[np.ndarray, " verts"] | None = None,
    ) -> tuple[ProjectorState, Vertices, ProjectionReport]:
        """Move the vertices of one frame out of the posed body.

        Args:
            state: From `start`, or from the frame before.
            posed: The body in this frame.
            vertices: The garment in this frame, any finite positions [m].
            dt: Time since the frame before [s].
            places: The face of the body that each vertex was held off from, -1 for none. Such a vertex is led out over
                that place or not at all: however near other skin is, it may be across flesh.

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
        from .project_frame import ProjectedFrame

        return ProjectedFrame(self, state, posed, vertices, places).projected(dt)
