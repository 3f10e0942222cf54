"""The memory of the graph network: the last poses of the body and the last coarse meshes."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.coarse.features.pose_history import POSE_INTERVAL, PoseHistory
from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Float

from .estimator_config import MESHES

if TYPE_CHECKING:
    from hemline.motions.motion import Pose


@dataclass(frozen=True, eq=False)
class History:
    """The memory of the graph network; never changed in place."""

    poses: PoseHistory
    """The last poses."""
    mesh_seconds: tuple[float, ...]
    """Times of the coarse meshes from now, at most 0 [s]."""
    meshes: tuple[Float[np.ndarray, "verts 3"], ...]
    """Coarse meshes of the last few steps in the world [m]."""
    joints: tuple[Float[np.ndarray, "joints 3"], ...]
    """Positions of the joints at the same times [m]."""

    @classmethod
    def standing(cls, pose: "Pose") -> Self:
        """Returns the history of a body that has always stood in one pose. Its mesh is not known yet."""
        return cls(PoseHistory.standing(pose), (), (), ())

    def advance(self, pose: "Pose", dt: float) -> Self:
        """Adds a pose after a time `dt` [s]. Its mesh is not known yet."""
        seconds = tuple(each - dt for each in self.mesh_seconds)
        return replace(self, poses=self.poses.advance(pose, dt), mesh_seconds=seconds)

    def with_mesh(self, mesh: np.ndarray, joints: np.ndarray) -> Self:
        """Adds the present coarse mesh and joints."""
        seconds, meshes, positions = (*self.mesh_seconds, 0.0), (*self.meshes, mesh), (*self.joints, joints)
        # keeps one mesh that is older than the network looks, to interpolate
        old = max(0, sum(each <= -(MESHES - 1) * POSE_INTERVAL + 1e-9 for each in seconds) - 1)
        return replace(self, mesh_seconds=seconds[old:], meshes=meshes[old:], joints=positions[old:])

    def last_meshes(self) -> tuple[Float[np.ndarray, "meshes verts 3"], Float[np.ndarray, "meshes joints 3"]]:
        """Interpolates the coarse meshes and the joints now and one and two intervals before, the oldest first [m]."""
        series: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        for wanted in POSE_INTERVAL * np.arange(1 - MESHES, 1):
            later = next(i for i, each in enumerate(self.mesh_seconds) if each >= wanted - 1e-9)
            earlier = max(0, later - 1)
            span = self.mesh_seconds[later] - self.mesh_seconds[earlier]
            ratio = (wanted - self.mesh_seconds[earlier]) / span if span > 0 else 1.0
            for values, out in zip((self.meshes, self.joints), series, strict=True):
                out.append(values[earlier] + np.float32(max(ratio, 0.0)) * (values[later] - values[earlier]))
        return np.array(series[0], np.float32), np.array(series[1], np.float32)

    def transform(self, transform: RigidTransform) -> Self:
        """Returns the history turned and shifted as a whole."""
        meshes, joints = (
            tuple(transform.points(each.astype(np.float64)).astype(np.float32) for each in values)
            for values in (self.meshes, self.joints)
        )
        return replace(self, poses=self.poses.transform(transform), meshes=meshes, joints=joints)
