"""A shaped body in one pose: joints at once, the mesh when it is first asked for."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Joints, Normals, Transforms, Vertices
from hemline.motions import Pose

from .pose_offsets import pose_offsets
from .skinning import Blending, skin_points
from .skinning_kernels import area_normals, turn_normals

if TYPE_CHECKING:
    from .shaped import ShapedBody


@dataclass(frozen=True, eq=False)
class PosedBody:
    """A body that has a shape and a pose.

    Attributes:
        shaped: The body at its betas.
        pose: The pose.
        transforms: Skin transforms [G_j O_j | x_j - G_j O_j J_j], from rest to world.
        joints: Joints in the world [m].
        blending: How the skin follows: `linear` or `dual`.
    """

    shaped: "ShapedBody"
    pose: Pose
    transforms: Transforms
    joints: Joints
    blending: Blending = "linear"

    @property
    def faces(self) -> Faces:
        """Triangles of the mesh."""
        return self.shaped.body.faces

    @property
    def rest_vertices(self) -> Vertices:
        """The mesh at rest that the skin follows from: that of the shape, and its pose-dependent offsets if any [m]."""
        posedirs = self.shaped.body.posedirs
        if posedirs is None:
            return self.shaped.vertices
        return self.shaped.vertices + pose_offsets(posedirs, self.pose.rotations)

    @cached_property
    def vertices(self) -> Vertices:
        """The mesh in the world [m]."""
        body = self.shaped.body
        return skin_points(
            self.transforms, body.weight_indices, body.weights, self.rest_vertices, blending=self.blending
        )

    @cached_property
    def normals(self) -> Normals:
        """Normals of the posed mesh, weighted by area: what the triangles truly say."""
        normals = np.empty_like(self.vertices)
        area_normals(self.vertices, self.faces, normals)
        return normals

    @cached_property
    def skinned_normals(self) -> Normals:
        """Rest normals turned with the joints: cheaper, without the vertices, and smooth where the skin creases.

        Pose-dependent offsets do not change them.
        """
        body, normals = self.shaped.body, np.empty_like(self.shaped.normals)
        turn_normals(self.transforms, body.weight_indices, body.weights, self.shaped.normals, normals)
        return normals
