"""Settings of the projection, what is prepared once, and the state that it keeps from frame to frame."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Self

import numpy as np

from hemline.arrays import Bool, Faces, Float, Int, UInt, Vertices
from hemline.collide.surface.box_kernels import BLOCK, GROUP
from hemline.collide.surface.garment_on_body import GarmentOnBody
from hemline.meshes import edges

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

Guarantee = Literal["exact", "fast"]


@dataclass(frozen=True)
class ProjectionSettings:
    """Distances and times of the projection."""

    margin: float = 0.0045
    """Vertices nearer to the skin than this are moved outward [m]."""
    gap: float = 0.0015
    """No vertex that is displaced ends nearer to the skin than this [m]."""
    far: float = 0.02
    """Vertices that were farther outside than this are tested in every frame, but measured in every fourth only [m]."""
    release: float = 0.05
    """Time constant with which a displacement that is no longer needed fades [s]."""


@dataclass(frozen=True)
class ProjectorState:
    """State of a projection: plain arrays in the projector's own order of vertices. Keep a copy to roll back."""

    frame: int
    """Number of frames done."""
    anchors: Int[np.ndarray, " verts"]
    """Face of the body that was found nearest last."""
    heights: Float[np.ndarray, " verts"]
    """Signed distance when last measured [m]."""
    offsets: Float[np.ndarray, "verts 3"]
    """Displacement in the last frame, in the frame of the key bone [m]."""
    directions: Int[np.ndarray, " groups"]
    """The axis along which each group of vertices sees least of the body."""
    hidden: UInt[np.ndarray, " groups"]
    """1 for groups of which no vertex could be certified by boxes, uint8."""
    lively: Bool[np.ndarray, " blocks"]
    """Blocks in which a vertex was displaced in the last frame; saved takes use this name."""


@dataclass(frozen=True)
class PreparedProjection:
    """A garment and a body prepared for the projection."""

    on_body: GarmentOnBody
    guarantee: Guarantee
    settings: ProjectionSettings
    measure: bool
    """Whether reports tell how many vertices were inside before, and how deep; it changes nothing else."""
    starts: Int[np.ndarray, " starts"]
    """Where the neighbours of each vertex begin in `neighbours`, in the projector's own order."""
    neighbours: Int[np.ndarray, " neighbours"]
    """Vertices along the edges of each vertex, one vertex after the other, in the projector's own order."""

    @classmethod
    def prepare(
        cls,
        shaped: "ShapedBody",
        garment_vertices_rest: Vertices,
        garment_faces: Faces,
        *,
        guarantee: Guarantee = "exact",
        settings: ProjectionSettings | None = None,
        measure: bool = True,
        on_body: GarmentOnBody | None = None,
    ) -> Self:
        """Prepares a garment on a body: cuts the body into patches and the garment into blocks.

        Args:
            shaped: The body.
            garment_vertices_rest: The garment at rest, in the world of the body's rest pose [m].
            garment_faces: Triangles of the garment; without any, each vertex is moved on its own.
            guarantee: `exact` tests every vertex in every frame; `fast` only displaces, and tests none.
            settings: Distances and times.
            measure: Report how many vertices were inside before, and how deep. This costs one more test of each vertex
                near the skin.
            on_body: Body and garment, already cut; None: they are cut here.

        Raises:
            BadBody: The body's mesh is not closed.
            BadGarment: The garment is empty or not finite.
        """
        on_body = on_body or GarmentOnBody.of(shaped, garment_vertices_rest)
        own = np.empty(len(on_body.order), np.int64)
        own[on_body.order] = np.arange(len(own))
        one, other = own[edges(garment_faces)].T
        first, second = np.concatenate([one, other]), np.concatenate([other, one])
        return cls(
            on_body=on_body,
            guarantee=guarantee,
            settings=settings or ProjectionSettings(),
            measure=measure,
            starts=np.concatenate([[0], np.cumsum(np.bincount(first, minlength=len(own)))]),
            neighbours=second[np.lexsort((second, first))],
        )

    def start(self) -> ProjectorState:
        """Returns the state before the first frame."""
        count = len(self.on_body.order)
        return ProjectorState(
            frame=0,
            anchors=self.on_body.nearest_faces,
            heights=np.zeros(count, np.float32),
            offsets=np.zeros((count, 3), np.float32),
            directions=np.zeros(-(-count // GROUP), np.int8),
            hidden=np.zeros(-(-count // GROUP), np.uint8),
            lively=np.zeros(-(-count // BLOCK), np.bool_),
        )
