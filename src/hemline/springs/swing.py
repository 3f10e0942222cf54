"""Spring bones as a player of VRM moves them: what a character that is written will do in an engine."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hemline.arrays import Float, Int

from .spring_bones import CapsuleColliders, SpringChains
from .swing_kernels import swing_chains

FRAME_SECONDS = 1 / 60
"""Length of the frame for which the constants of spring bones are meant [s]."""


class SwingSprings(NamedTuple):
    """Chains as the kernels read them; arrays of bones are for the bone as a tail."""

    offsets: Int[np.ndarray, " chains_and_one"]
    """First bone of each chain, followed by the number of all bones."""
    joints: Int[np.ndarray, " chains"]
    """The joint that carries each chain."""
    roots: Float[np.ndarray, "chains 3"]
    """Place of the root of each chain, from the joint, at rest [m]."""
    directions: Float[np.ndarray, "bones 3"]
    """Direction at rest from the bone above."""
    lengths: Float[np.ndarray, " bones"]
    """Distance from the bone above [m]."""
    stiffness: Float[np.ndarray, " bones"]
    """Pull towards the direction at rest [m/s per frame]."""
    gravity: Float[np.ndarray, " bones"]
    """Downward pull [m/s per frame]."""
    drag: Float[np.ndarray, " bones"]
    """Fraction of the velocity that is lost per frame [1]."""
    radii: Float[np.ndarray, " bones"]
    """Distance from colliders [m]."""
    axes: Float[np.ndarray, "bones 3 3"]
    """Axes of the limit at rest, as columns."""
    limits: Float[np.ndarray, "bones 2"]
    """Largest pitch and yaw [rad]; pi or more: none."""


class SwingCapsules(NamedTuple):
    """Capsules in all frames, as the kernels read them."""

    starts: Float[np.ndarray, "frames capsules 3"]
    """One end of each axis [m]."""
    ends: Float[np.ndarray, "frames capsules 3"]
    """Other end of each axis [m]."""
    radii: Float[np.ndarray, " capsules"]
    """Radius of each capsule [m]."""
    chains: Int[np.ndarray, " capsules"]
    """The only chain that collides with each capsule; -1: all do."""


class SwingBody(NamedTuple):
    """The body in all frames, as the kernels read it."""

    joints: Float[np.ndarray, "frames joints 3"]
    """Positions of the joints [m]."""
    turns: Float[np.ndarray, "frames joints 3 3"]
    """Rotations of the joints from the T-pose."""


@dataclass(frozen=True, eq=False)
class SkeletonMotion:
    """The joints of a body in a clip.

    Attributes:
        rest: Positions of the joints in the T-pose, where the chains are at rest [m].
        joints: Positions of the joints in each frame [m].
        turns: Rotation of each joint from the T-pose.
    """

    rest: Float[np.ndarray, "joints 3"]
    joints: Float[np.ndarray, "frames joints 3"]
    turns: Float[np.ndarray, "frames joints 3 3"]


def swing(
    chains: SpringChains, capsules: CapsuleColliders, skeleton: SkeletonMotion, dt: float = FRAME_SECONDS
) -> tuple[Float[np.ndarray, "frames bones 3"], Float[np.ndarray, "frames bones 3 3"]]:
    """Swings spring bones over a clip, from rest in its first frame, as a player of VRM does.

    Each tail keeps what drag leaves of its motion, is pulled towards its direction at rest and downwards, is put at its
    distance from the bone above and within its limit, and out of one capsule after the other.

    Args:
        chains: The chains at rest.
        capsules: The capsules at rest.
        skeleton: The body.
        dt: Length of a frame [s].

    Returns:
        The bones in the world [m], and the rotation of each from rest; the last bone of a chain is only a tail, and its
        rotation is that of the joint that carries the chain.

    Format: https://github.com/vrm-c/vrm-specification, `VRMC_springBone` 1.0 and `VRMC_springBone_limit` 1.0 (draft).
    """
    frames, bones = len(skeleton.joints), len(chains.bones)
    tails, turns = np.empty((frames, bones, 3)), np.empty((frames, bones, 3, 3))
    moving = SwingCapsules(
        *move_capsules(capsules, skeleton), _plain(capsules.radii), np.ascontiguousarray(capsules.chains, np.int64)
    )
    body = SwingBody(_plain(skeleton.joints), _plain(skeleton.turns))
    swing_chains(_springs(chains, skeleton.rest), moving, body, float(dt), tails, turns)
    return tails, turns


def move_capsules(
    capsules: CapsuleColliders, skeleton: SkeletonMotion
) -> tuple[Float[np.ndarray, "frames capsules 3"], Float[np.ndarray, "frames capsules 3"]]:
    """Returns both ends of each capsule in each frame [m]."""
    at = capsules.joints
    turns, joints = skeleton.turns[:, at], skeleton.joints[:, at]
    starts, ends = (each - skeleton.rest[at] for each in (capsules.starts, capsules.ends))
    return _plain((turns @ starts[..., None])[..., 0] + joints), _plain((turns @ ends[..., None])[..., 0] + joints)


def _limit_axes(chains: SpringChains) -> Float[np.ndarray, "bones 3 3"]:
    """Returns the axes of each bone's spherical limit at rest, as columns: y is the middle of its range, z outwards."""
    frames = np.repeat(chains.frames, np.diff(chains.offsets), axis=0)
    local = np.einsum("bji,bj->bi", frames, _directions(chains))
    local[np.linalg.norm(local, axis=1) == 0] = [0, 1, 0]
    return frames @ _from_y(local) @ _about_x(chains.tilts)


def _springs(chains: SpringChains, rest: Float[np.ndarray, "joints 3"]) -> SwingSprings:
    roots = chains.offsets[:-1]
    above = np.diff(chains.bones, axis=0, prepend=chains.bones[:1])
    above[roots] = 0
    return SwingSprings(
        np.ascontiguousarray(chains.offsets, np.int64),
        np.ascontiguousarray(chains.joints, np.int64),
        *map(
            _plain,
            (
                chains.bones[roots] - rest[chains.joints],
                _directions(chains),
                np.linalg.norm(above, axis=1),
                chains.stiffness,
                chains.gravity,
                chains.drag,
                chains.radii,
                _limit_axes(chains),
                np.stack([chains.pitches, chains.yaws], axis=1),
            ),
        ),
    )


def _directions(chains: SpringChains) -> Float[np.ndarray, "bones 3"]:
    """Returns the direction of each bone from the one above, at rest; 0 for roots."""
    above = np.diff(chains.bones, axis=0, prepend=chains.bones[:1])
    above[chains.offsets[:-1]] = 0
    return above / np.maximum(np.linalg.norm(above, axis=1), 1e-12)[:, None]


def _from_y(directions: Float[np.ndarray, "bones 3"]) -> Float[np.ndarray, "bones 3 3"]:
    """Returns the shortest rotation from the axis y to each direction."""
    x, y, z = directions.T
    scale = 1 / np.maximum(1 + y, 1e-9)
    return np.stack(
        [
            np.stack([1 - scale * x * x, x, -scale * x * z], axis=-1),
            np.stack([-x, y, -z], axis=-1),
            np.stack([-scale * x * z, z, 1 - scale * z * z], axis=-1),
        ],
        axis=-2,
    )


def _about_x(angles: Float[np.ndarray, " bones"]) -> Float[np.ndarray, "bones 3 3"]:
    """Returns the rotation about the axis x by each angle [rad]."""
    turns = np.tile(np.eye(3), (len(angles), 1, 1))
    turns[:, 1, 1] = turns[:, 2, 2] = np.cos(angles)
    turns[:, 2, 1], turns[:, 1, 2] = np.sin(angles), -np.sin(angles)
    return turns


def _plain(array: np.ndarray) -> Float[np.ndarray, "..."]:
    return np.ascontiguousarray(array, np.float64)
