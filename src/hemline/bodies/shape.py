"""A body model with given shape coefficients: its mesh and joints at rest, and its transforms in a pose.

`place` and `untangling` need no more than this; users hold a `body.ShapedBody`.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from hemline.arrays import Betas, Float, Joints, Normals, Vertices
from hemline.errors import BadBody
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import inverse, multiply

from .model import BodyModel
from .skinning_kernels import area_normals, pose_joints

LARGEST_BETA = 20
"""Largest absolute shape coefficient; beyond, a shape is no body."""


@dataclass(frozen=True, eq=False)
class BodyShape:
    """A body model with a shape.

    Attributes:
        body: The body model.
        betas: All shape coefficients, in standard deviations.
        vertices: The mesh at rest, in the body's own rest pose, the pelvis at the origin [m].
        joints: Joints at rest [m].
        normals: Normals of the mesh at rest, weighted by area.
        leg_length: Hip to knee to ankle, mean of both legs [m].
    """

    body: BodyModel
    betas: Betas
    vertices: Vertices
    joints: Joints
    normals: Normals
    leg_length: float

    @classmethod
    def of(cls, body: BodyModel, betas: Betas | tuple[float, ...] | list[float]) -> Self:
        """Returns the model with given betas, see `Body.shaped`."""
        full = _full_betas(body, betas)
        vertices = body.template + np.einsum("b,bvc->vc", full, body.shapedirs)
        joints = body.joints + np.einsum("b,bjc->jc", full, body.joint_shapedirs)
        normals = np.empty_like(vertices)
        area_normals(vertices, body.faces, normals)
        return cls(body, full, vertices, joints, normals, _leg_length(joints))

    @cached_property
    def rest_pose(self) -> Pose:
        """The pose whose mesh is the mesh at rest."""
        offsets = self.body.rest_offsets.astype(np.float64)
        parents = offsets[np.maximum(self.body.parents, 0)]
        parents[0] = [1, 0, 0, 0]
        return Pose(multiply(parents, inverse(offsets)), self.joints[0])

    def joints_at(self, pose: Pose) -> Joints:
        """Returns the joints in the world in a pose [m]."""
        return self.transforms_of(pose.rotations[None], pose.translation[None])[1][0]

    def transforms_of(
        self, rotations: Float[np.ndarray, "frames joints 4"], translations: Float[np.ndarray, "frames 3"]
    ) -> tuple[Float[np.ndarray, "frames joints 3 4"], Float[np.ndarray, "frames joints 3"]]:
        """Returns skin transforms and joints of many poses, as `PosedBody` has them for one."""
        frames, joints = rotations.shape[:2]
        transforms = np.empty((frames, joints, 3, 4), dtype=np.float32)
        positions = np.empty((frames, joints, 3), dtype=np.float32)
        body = self.body
        pose_joints(rotations, translations, self.joints, body.parents, body.rest_offsets, transforms, positions)
        return transforms, positions


def _full_betas(body: BodyModel, betas: Betas | tuple[float, ...] | list[float]) -> Float[np.ndarray, " all_betas"]:
    count = len(body.shapedirs)
    try:
        given = np.asarray(betas, dtype=np.float32)
    except (TypeError, ValueError) as reason:
        raise BadBody("betas must be numbers", betas, f"give at most {count} numbers") from reason
    if given.ndim != 1 or len(given) > count:
        raise BadBody(
            f"body '{body.name}' has {count} betas",
            len(given) if given.ndim == 1 else f"shape {given.shape}",
            f"give a list of at most {count} numbers",
        )
    if not np.isfinite(given).all():
        raise BadBody("betas must be finite", given.tolist(), "give numbers of about -3 to 3")
    if np.abs(given).max(initial=0) > LARGEST_BETA:
        raise BadBody(f"betas must be from -{LARGEST_BETA} to {LARGEST_BETA}", given.tolist(), "give about -3 to 3")
    full = np.zeros(count, dtype=np.float32)
    full[: len(given)] = given
    return full


def _leg_length(joints: Joints) -> float:
    chains = [[JOINT_NAMES.index(f"{side}_{name}") for name in ("hip", "knee", "ankle")] for side in ("left", "right")]
    bones = np.diff(joints[chains].astype(np.float64), axis=1)
    return float(np.linalg.norm(bones, axis=2).sum() / 2)
