"""A garment at rest on a body, and the part of the body next to each of its vertices."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import BodyVertices, Int, Vertices
from hemline.errors import BadGarment

from .box_kernels import BLOCK
from .patches import Patches, dominant_joints, make_patches, vertex_blocks
from .posed_surface import PosedSurface

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody


@dataclass(frozen=True)
class GarmentOnBody:
    """The body's surface in patches, the garment's vertices in blocks, and the body vertex nearest to each of them."""

    patches: Patches
    order: Int[np.ndarray, " verts"]
    """Vertices in compact blocks: from the order of the kernels to the garment's own."""
    nearest: Int[np.ndarray, " verts"]
    """Body vertex nearest to each garment vertex at rest, both renumbered."""
    limb: Int[np.ndarray, " verts"]
    """The limb that each garment vertex belongs to: that of its nearest body vertex."""
    key_joint: int
    """The bone that most of the garment is next to; kernels work in its frame."""

    @classmethod
    def of(
        cls,
        shaped: "ShapedBody",
        rest: Vertices,
        *,
        patches: Patches | None = None,
        made_on: BodyVertices | None = None,
    ) -> Self:
        """Cuts the body into patches and the garment into blocks.

        Args:
            shaped: The body.
            rest: The garment at rest, in the world of the body's rest pose [m].
            patches: The body, already cut; None: it is cut here.
            made_on: Vertices of the body on which the garment rests, if that has another shape [m].

        Raises:
            BadBody: The body's mesh is not closed.
            BadGarment: The garment is empty or not finite.
        """
        from scipy.spatial import KDTree

        rest = np.asarray(rest, np.float32).reshape(-1, 3)
        if not len(rest) or not np.isfinite(rest).all():
            raise BadGarment("the projection needs a garment", f"{len(rest)} vertices, not all finite", "give a mesh")
        patches = patches or make_patches(shaped)
        order, body = vertex_blocks(rest, BLOCK), shaped.vertices if made_on is None else made_on
        nearest = np.asarray(KDTree(body[patches.order]).query(rest[order])[1])
        joints = dominant_joints(shaped.body.weight_indices, shaped.body.weights)[patches.order[nearest]]
        return cls(
            patches=patches,
            order=order.astype(np.int32),
            nearest=nearest.astype(np.int32),
            limb=patches.limb[nearest],
            key_joint=int(np.bincount(joints).argmax()),
        )

    @property
    def nearest_faces(self) -> Int[np.ndarray, " verts"]:
        """Index in `patches.faces` of a face around the body vertex nearest to each garment vertex."""
        return self.patches.ring[self.patches.ring_start[self.nearest]]

    def check_vertices(self, vertices: Vertices) -> Vertices:
        """Returns the vertices of a frame [m], float32 and contiguous, if they can be this garment's.

        Raises:
            BadGarment: The number of vertices differs from the garment's, or a position is not finite.
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
        return vertices

    def surface(self, posed: "PosedBody") -> PosedSurface:
        """Returns the body's surface in a pose; all steps of a frame can share it."""
        return PosedSurface.of(self.patches, self.key_joint, posed)
