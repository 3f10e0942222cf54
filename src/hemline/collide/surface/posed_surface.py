"""The body's surface in one pose, in the frame of one bone."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Float, Int, Points, Vertices

from .box_kernels import into_frame, out_of_frame, surface_boxes
from .patches import Patches
from .surface_kernels import SkinPatches

if TYPE_CHECKING:
    from hemline.bodies import PosedBody


@dataclass(frozen=True, eq=False)
class PosedSurface:
    """The skin of one frame, computed once by `GarmentOnBody.surface` and shared by all steps."""

    to_world: Float[np.ndarray, "3 4"]
    """The bone's frame to the world, float32."""
    skin: SkinPatches
    """The surface, in the bone's frame."""

    @classmethod
    def of(cls, patches: Patches, joint: int, posed: "PosedBody") -> "PosedSurface":
        """Makes the surface of a posed body.

        Args:
            patches: The surface, cut into patches.
            joint: The bone whose frame is used.
            posed: The body.
        """
        return cls.at(patches, posed.transforms[joint], posed.vertices)

    @classmethod
    def at(cls, patches: Patches, bone: Float[np.ndarray, "3 4"], vertices: Vertices) -> "PosedSurface":
        """Makes the surface from vertices in the world.

        Args:
            patches: The surface, cut into patches.
            bone: The bone's frame to the world.
            vertices: Vertices of the surface in the world [m].
        """
        to_world = np.ascontiguousarray(bone, np.float32)
        body = np.empty((len(patches.order), 3), np.float32)
        into_frame(to_world, vertices, patches.order, body)
        leaf_box = np.empty((6, len(patches.leaf_start) - 1), np.float32)
        patch_box = np.empty((6, len(patches.patch_start) - 1), np.float32)
        surface_boxes(body, patches.leaf_start, patches.leaf_vertices, patches.patch_start, leaf_box, patch_box)
        skin = SkinPatches(
            body=body,
            faces=patches.faces,
            across=patches.across,
            ring_start=patches.ring_start,
            ring=patches.ring,
            leaf_start=patches.leaf_start,
            leaf_vertices=patches.leaf_vertices,
            leaf_box=leaf_box,
            patch_start=patches.patch_start,
            patch_box=patch_box,
            patch_limb=patches.patch_limb,
            leaf_limb=patches.leaf_limb,
            known=np.zeros(len(body), np.bool_),
            normals=np.empty_like(body),
        )
        return cls(to_world, skin)

    def into_bone_frame(self, points: Points, order: Int[np.ndarray, " points"]) -> Points:
        """Moves points of the world into the bone's frame, reordered; float32 [m]."""
        out = np.empty((len(order), 3), np.float32)
        into_frame(self.to_world, points, order, out)
        return out

    def out_of_bone_frame(self, points: Points, order: Int[np.ndarray, " points"]) -> Points:
        """Moves points of the bone's frame into the world, in the order before `into_bone_frame`; float32 [m]."""
        out = np.empty_like(points)
        out_of_frame(self.to_world, points, order, out)
        return out
