"""What the graph network remembers: the last poses of the body, and its last coarse meshes."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.coarse.features.seen import POSE_INTERVAL, PoseHistory
from hemline.animators.teleport import RigidTransform
from hemline.arrays import Float

from .estimator_config import MESHES

if TYPE_CHECKING:
    from hemline.motions.motion import Pose


@dataclass(frozen=True, eq=False)
class History:
    """What the network remembers; never changed in place."""

    times: PoseHistory
    mesh_seconds: tuple[float, ...]
    """From now, so at most 0 [s]."""
    meshes: tuple[Float[np.ndarray, "verts 3"], ...]
    """The coarse meshes of the last few steps in the world [m]."""
    joints: tuple[Float[np.ndarray, "joints 3"], ...]
    """The joints then [m]."""

    @classmethod
    def standing(cls, pose: "Pose") -> Self:
        """Of a body that has always stood so; its mesh is not known yet."""
        return cls(PoseHistory.standing(pose), (), (), ())

    def advance(self, pose: "Pose", dt: float) -> Self:
        """After a time `dt` [s], in a pose; its mesh is not known yet."""
        return replace(
            self, times=self.times.advance(pose, dt), mesh_seconds=tuple(each - dt for each in self.mesh_seconds)
        )

    def with_mesh(self, mesh: np.ndarray, joints: np.ndarray) -> Self:
        """The same, the present coarse mesh known."""
        seconds, meshes, places = (*self.mesh_seconds, 0.0), (*self.meshes, mesh), (*self.joints, joints)
        # one that is older than the network looks is enough
        old = max(0, sum(each <= -(MESHES - 1) * POSE_INTERVAL + 1e-9 for each in seconds) - 1)
        return replace(self, mesh_seconds=seconds[old:], meshes=meshes[old:], joints=places[old:])

    def last_meshes(self) -> tuple[Float[np.ndarray, "meshes verts 3"], Float[np.ndarray, "meshes joints 3"]]:
        """The coarse meshes now and one and two ticks before, the oldest first; and the joints then [m]."""
        found: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        for wanted in POSE_INTERVAL * np.arange(1 - MESHES, 1):
            later = next(i for i, each in enumerate(self.mesh_seconds) if each >= wanted - 1e-9)
            earlier = max(0, later - 1)
            span = self.mesh_seconds[later] - self.mesh_seconds[earlier]
            share = (wanted - self.mesh_seconds[earlier]) / span if span > 0 else 1.0
            for which, out in zip((self.meshes, self.joints), found, strict=True):
                out.append(which[earlier] + np.float32(max(share, 0.0)) * (which[later] - which[earlier]))
        return np.array(found[0], np.float32), np.array(found[1], np.float32)

    def transform(self, way: RigidTransform) -> Self:
        """Turned and moved as a whole."""
        meshes, joints = (
            tuple(way.points(each.astype(np.float64)).astype(np.float32) for each in which)
            for which in (self.meshes, self.joints)
        )
        return replace(self, times=self.times.transform(way), meshes=meshes, joints=joints)
