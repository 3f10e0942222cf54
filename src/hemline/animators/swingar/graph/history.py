"""The last poses of a body and the last coarse meshes, at 30 frames a second whatever the steps were."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.animators.leaps import Rigid
from hemline.arrays import Float
from hemline.motions.quaternions import from_matrix, heading, inverse, multiply, rotate, slerp, to_axis_angle, to_matrix

from .estimator_config import JOINTS, MESHES, POSE_WIDTH, POSES

if TYPE_CHECKING:
    from hemline.bodies import PosedBody
    from hemline.motions.motion import Pose

TICK = 1 / 30
"""Time between poses that the network is given [s]."""


@dataclass(frozen=True)
class Times:
    """Some moments of a body, the last one now."""

    seconds: Float[np.ndarray, " times"]
    """From now, so at most 0 [s]."""
    rotations: Float[np.ndarray, "times joints 4"]
    translations: Float[np.ndarray, "times 3"]
    """Of the pelvis [m]."""

    @classmethod
    def always(cls, pose: "Pose") -> Self:
        """A body that has always stood so: the history before the first frame."""
        return cls(np.zeros(1), pose.rotations[None].astype(np.float64), pose.translation[None].astype(np.float64))

    def followed(self, pose: "Pose", dt: float) -> Self:
        """After a time `dt` [s], in a pose; what lies farther back than the network looks is dropped."""
        seconds = np.append(self.seconds - dt, 0.0)
        kept = slice(max(0, int(np.searchsorted(seconds, -POSES * TICK, side="right")) - 1), None)
        rotations = np.concatenate([self.rotations, pose.rotations[None].astype(np.float64)])
        translations = np.concatenate([self.translations, pose.translation[None].astype(np.float64)])
        return type(self)(seconds[kept], rotations[kept], translations[kept])

    def moved(self, way: Rigid) -> Self:
        """Turned and moved as a whole."""
        rotations = self.rotations.copy()
        rotations[:, 0] = multiply(from_matrix(way.turn)[None], rotations[:, 0])
        return replace(self, rotations=rotations, translations=way.points(self.translations))

    def window(self) -> Float[np.ndarray, "poses 75"]:
        """The last 65 poses as the motion encoder wants them, float32: axis-angles, the pelvis's way since the pose
        before [m]; all as seen from the heading of the last one.

        Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Sections III-C and IV (m = 64). Differs: one heading for all.
        """
        wanted = TICK * np.arange(-POSES, 1)
        later = np.clip(np.searchsorted(self.seconds, wanted), 1, max(1, len(self.seconds) - 1))
        if len(self.seconds) == 1:
            rotations = np.repeat(self.rotations, POSES + 1, axis=0)
            translations = np.repeat(self.translations, POSES + 1, axis=0)
        else:
            span = self.seconds[later] - self.seconds[later - 1]
            share = np.clip((wanted - self.seconds[later - 1]) / span, 0, 1)
            rotations = slerp(self.rotations[later - 1], self.rotations[later], share[:, None])
            one, other = self.translations[later - 1], self.translations[later]
            translations = one + share[:, None] * (other - one)
        back = inverse(heading(rotations[-1, 0]))
        rotations[:, 0] = multiply(back[None], rotations[:, 0])
        found = np.empty((POSES, POSE_WIDTH), np.float32)
        found[:, : 3 * JOINTS] = to_axis_angle(rotations[1:]).reshape(POSES, -1)
        found[:, 3 * JOINTS :] = rotate(back[None], np.diff(translations, axis=0))
        return found


@dataclass(frozen=True)
class Seen:
    """A posed body as the network sees it: the pelvis is the origin, its heading is taken out."""

    turn: Float[np.ndarray, "3 3"]
    """From that heading to the world."""
    origin: Float[np.ndarray, "3"]
    """The pelvis [m]."""

    @classmethod
    def of(cls, pose: "Pose") -> Self:
        """That of a pose."""
        return cls(to_matrix(heading(pose.rotations[0].astype(np.float64))), pose.translation.astype(np.float64))

    def into(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Points of the world, seen [m], float32."""
        return ((points - self.origin) @ self.turn).astype(np.float32)

    def out(self, points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
        """Points that are seen, in the world [m], float32."""
        return (points @ self.turn.T + self.origin).astype(np.float32)

    def turns(self, turns: Float[np.ndarray, "verts 4"]) -> Float[np.ndarray, "verts 4"]:
        """Turns into the world, wxyz, seen; float32."""
        return multiply(inverse(from_matrix(self.turn)), turns.astype(np.float64)).astype(np.float32)

    def transforms(self, posed: "PosedBody") -> Float[np.ndarray, "joints 3 4"]:
        """Skin transforms of a body, seen; float32."""
        found = self.turn.T @ posed.transforms.astype(np.float64)
        found[:, :, 3] -= self.turn.T @ self.origin
        return np.ascontiguousarray(found, np.float32)


@dataclass(frozen=True, eq=False)
class History:
    """What the network remembers; never changed in place."""

    times: Times
    mesh_seconds: tuple[float, ...]
    """From now, so at most 0 [s]."""
    meshes: tuple[Float[np.ndarray, "verts 3"], ...]
    """The coarse meshes of the last few steps in the world [m]."""
    joints: tuple[Float[np.ndarray, "joints 3"], ...]
    """The joints then [m]."""

    @classmethod
    def always(cls, pose: "Pose") -> Self:
        """Of a body that has always stood so; its mesh is not known yet."""
        return cls(Times.always(pose), (), (), ())

    def followed(self, pose: "Pose", dt: float) -> Self:
        """After a time `dt` [s], in a pose; its mesh is not known yet."""
        return replace(
            self, times=self.times.followed(pose, dt), mesh_seconds=tuple(each - dt for each in self.mesh_seconds)
        )

    def with_mesh(self, mesh: np.ndarray, joints: np.ndarray) -> Self:
        """The same, the present coarse mesh known."""
        seconds, meshes, places = (*self.mesh_seconds, 0.0), (*self.meshes, mesh), (*self.joints, joints)
        # one that is older than the network looks is enough
        old = max(0, sum(each <= -(MESHES - 1) * TICK + 1e-9 for each in seconds) - 1)
        return replace(self, mesh_seconds=seconds[old:], meshes=meshes[old:], joints=places[old:])

    def last_meshes(self) -> tuple[Float[np.ndarray, "meshes verts 3"], Float[np.ndarray, "meshes joints 3"]]:
        """The coarse meshes now and one and two ticks before, the oldest first; and the joints then [m]."""
        found: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        for wanted in TICK * np.arange(1 - MESHES, 1):
            later = next(i for i, each in enumerate(self.mesh_seconds) if each >= wanted - 1e-9)
            earlier = max(0, later - 1)
            span = self.mesh_seconds[later] - self.mesh_seconds[earlier]
            share = (wanted - self.mesh_seconds[earlier]) / span if span > 0 else 1.0
            for which, out in zip((self.meshes, self.joints), found, strict=True):
                out.append(which[earlier] + np.float32(max(share, 0.0)) * (which[later] - which[earlier]))
        return np.array(found[0], np.float32), np.array(found[1], np.float32)

    def moved(self, way: Rigid) -> Self:
        """Turned and moved as a whole."""
        meshes, joints = (
            tuple(way.points(each.astype(np.float64)).astype(np.float32) for each in which)
            for which in (self.meshes, self.joints)
        )
        return replace(self, times=self.times.moved(way), meshes=meshes, joints=joints)
