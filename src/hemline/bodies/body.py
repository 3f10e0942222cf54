"""A body in its three states: as a model, with a shape, and in a pose. Each makes the next.

Arrays and arithmetic are in `model`, `shape`, `skinning`, `place` and `untangling`.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hemline.arrays import Betas, Faces, Joints, Normals, Transforms, Vertices
from hemline.bodies.untangling.untangling import untangle, untangle_motion
from hemline.motions import Motion, Pose

from .model import BodyModel
from .place import place_motion
from .pose_offsets import pose_offsets
from .shape import BodyShape
from .skinning import Blending, skin_points
from .skinning_kernels import area_normals, turn_normals


@dataclass(frozen=True, eq=False)
class Body(BodyModel):
    """A skinned mesh on the 24-joint skeleton, linear in its shape coefficients; `BodyModel` lists its arrays."""

    def shaped(self, betas: Betas | tuple[float, ...] | list[float] = ()) -> "ShapedBody":
        """Returns this body with given shape coefficients, ready to be posed.

        Args:
            betas: Shape coefficients in standard deviations; missing ones are 0. The first one is stature.

        Raises:
            BadBody: There are more betas than the body has, NaN among them, or they are no list of numbers.
        """
        return ShapedBody.of(self, betas)

    @cached_property
    def bare(self) -> "Body":
        """This body without its accessories, or this body itself if there are none."""
        if not self.accessory_vertices:
            return self
        own = slice(0, len(self.template) - self.accessory_vertices)
        return replace(
            self,
            name=self.bare_name,
            template=self.template[own],
            faces=self.faces[self.faces[:, 0] < own.stop],
            shapedirs=self.shapedirs[:, own],
            weight_indices=self.weight_indices[own],
            weights=self.weights[own],
            posedirs=None if self.posedirs is None else self.posedirs[:, own],
            accessory_vertices=0,
            bare_name="",
        )


@dataclass(frozen=True, eq=False)
class ShapedBody(BodyShape):
    """A body with a shape; `BodyShape` lists its arrays."""

    body: Body

    @cached_property
    def bare(self) -> "ShapedBody":
        """This shape of the body without its accessories, or this shape itself if there are none."""
        return self if self.body.bare is self.body else self.body.bare.shaped(self.betas)

    def posed(self, pose: Pose, *, blending: Blending = "linear") -> "PosedBody":
        """Returns this body in a pose; the mesh is skinned when it is first used.

        Args:
            pose: The pose.
            blending: `linear`, or `dual` quaternions, which keep the volume of twisted limbs.
        """
        transforms, joints = self.transforms_of(pose.rotations[None], pose.translation[None])
        return PosedBody(self, pose, transforms[0], joints[0], blending)

    def placed(self, motion: Motion) -> Motion:
        """Returns a motion scaled to this body's legs, with its soles on the floor, see `place.place_motion`."""
        return place_motion(self, motion)

    def untangle(self, pose: Pose) -> Pose:
        """Returns a pose with limbs lifted out of each other; `untangling.untangle` also tells by how much."""
        return untangle(self, pose).pose

    def untangle_motion(self, motion: Motion) -> Motion:
        """Returns a motion with limbs lifted out of each other, see `untangling.untangle_motion`."""
        return untangle_motion(self, motion).motion


@dataclass(frozen=True, eq=False)
class PosedBody:
    """A body with a shape and a pose.

    Attributes:
        shaped: The body at its betas.
        pose: The pose.
        transforms: Skin transforms [G_j O_j | x_j - G_j O_j J_j], from rest to world.
        joints: Joints in the world [m].
        blending: Blending of transforms for the skin: `linear` or `dual`.
        origin: Place in the world relative to which all positions are given [m]. It is zero unless a `Player` plays a
            body that is far away.
    """

    shaped: ShapedBody
    pose: Pose
    transforms: Transforms
    joints: Joints
    blending: Blending = "linear"
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def faces(self) -> Faces:
        """Triangles of the mesh."""
        return self.shaped.body.faces

    @property
    def rest_vertices(self) -> Vertices:
        """The mesh at rest that is skinned: that of the shape plus pose-dependent offsets, if any [m]."""
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
        """Exact normals of the posed mesh, weighted by area."""
        normals = np.empty_like(self.vertices)
        area_normals(self.vertices, self.faces, normals)
        return normals

    @cached_property
    def skinned_normals(self) -> Normals:
        """Rest normals turned with the joints: cheaper, as they need no vertices, and smooth where the skin creases.

        Pose-dependent offsets do not change them.
        """
        body, normals = self.shaped.body, np.empty_like(self.shaped.normals)
        turn_normals(self.transforms, body.weight_indices, body.weights, self.shaped.normals, normals)
        return normals
