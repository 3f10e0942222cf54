"""The ropes of a model as spring bones, which an engine swings itself."""

from dataclasses import replace

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, Int, Nodes
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, PARENTS, Motion, Pose
from hemline.springs import CapsuleColliders, SkeletonMotion, SpringChains, SpringConstants, distances_to_axes

DEFAULT_CONSTANTS = SpringConstants(
    stiffness=(108.0, 2.12e-4),
    gravity=2.88,
    drag=(0.229, 0.763),
    radius=0.0485,
    inward=0.284,
    sideways=0.166,
    leg_radius=0.212,
)
"""Constants for models that have none of their own: those of the shipped skirt, rounded."""
LEGS = tuple(JOINT_NAMES.index(f"{side}_{joint}") for side in ("left", "right") for joint in ("hip", "knee"))
"""Joints of the legs, which push a garment."""
_TRUNK = ("pelvis", "spine1", "spine2", "spine3")
_WAIST = ("spine1", "spine2")
_RUN_UP_SECONDS = 1
"""Time from the T-pose to the first pose of a clip, and again in that pose, in which chains come to rest [s]."""


def spring_chains(
    ropes: Ropes, nodes: Nodes, posed: PosedBody, constants: SpringConstants = DEFAULT_CONSTANTS
) -> tuple[SpringChains, CapsuleColliders]:
    """Returns the chains of the ropes as spring bones, and the capsules that they collide with.

    Args:
        ropes: The ropes.
        nodes: All bones of the ropes, with the garment settled on the body in the T-pose [m].
        posed: The body in that pose.
        constants: Constants of the spring bones.
    """
    return constants.apply(*resting_chains(ropes, nodes, posed), LEGS)


def resting_chains(ropes: Ropes, nodes: Nodes, posed: PosedBody) -> tuple[SpringChains, CapsuleColliders]:
    """Returns the chains of the ropes without constants, and capsules of the body so thin that no bone is inside one.

    Args:
        ropes: The ropes.
        nodes: All bones of the ropes, with the garment settled on the body in the T-pose [m].
        posed: The body in that pose.
    """
    first = int(ropes.chains.offsets[0])
    bones, offsets = nodes[first:], ropes.chains.offsets - first
    joints = np.array([_carrier(joint) for joint in ropes.chains.chain_joints.tolist()], np.int32)
    chains = SpringChains.at_rest(bones, offsets, joints, _outward(bones, offsets, posed.joints[joints]))
    capsules = capsules_of(posed)
    away = distances_to_axes(bones[chains.depths > 0], capsules.starts, capsules.ends)[0]
    return chains, replace(capsules, radii=np.minimum(capsules.radii, away.min(axis=0)))


def capsules_of(posed: PosedBody) -> CapsuleColliders:
    """Returns the rounded cones that ropes collide with as capsules of their mean radius, in a pose."""
    primitives, transforms = BodyPrimitives.fit(posed.shaped), np.asarray(posed.transforms, np.float64)[:, None]
    turns = transforms[primitives.joints, 0]
    starts, ends = (
        np.einsum("prc,pc->pr", turns[..., :3], primitives.shapes[:, at : at + 3]) + turns[..., 3] for at in (0, 3)
    )
    radii = primitives.shapes[:, 6:8].mean(axis=1)
    return CapsuleColliders(primitives.joints, starts, ends, radii, np.full(len(radii), -1))


def t_pose(body: ShapedBody) -> PosedBody:
    """Returns a body in the T-pose, with its soles at height 0."""
    still = _still(1)[0]
    floor = body.posed(Pose(still, np.zeros(3, np.float32))).vertices[:, 1].min()
    return body.posed(Pose(still, np.array([0.0, -floor, 0.0], np.float32)))


def skeleton_of(rest: PosedBody, motion: Motion) -> SkeletonMotion:
    """Returns the joints in a clip after a run-up: a second from the T-pose to its first pose, and a second in that.

    Args:
        rest: The body in the T-pose.
        motion: The clip, at the frame rate of the engine.
    """
    fps = motion.fps
    way = replace(
        motion,
        rotations=np.concatenate([_still(1), motion.rotations[:1]]),
        translations=np.repeat(motion.translations[:1], 2, axis=0),
        fps=1.0 / _RUN_UP_SECONDS,
    ).resample(fps)
    stay = round(_RUN_UP_SECONDS * fps)
    rotations = np.concatenate([way.rotations, np.repeat(motion.rotations[:1], stay, axis=0), motion.rotations])
    start = np.repeat(motion.translations[:1], len(way) + stay, axis=0)
    transforms, joints = rest.shaped.transforms_of(rotations, np.concatenate([start, motion.translations]))
    turns = np.asarray(transforms, np.float64)[..., :3] @ np.swapaxes(rest.transforms[:, :, :3], 1, 2)
    return SkeletonMotion(np.asarray(rest.joints, np.float64), np.asarray(joints, np.float64), turns)


def _still(frames: int) -> Float[np.ndarray, "frames joints 4"]:
    still = np.zeros((frames, JOINT_COUNT, 4), np.float32)
    still[..., 0] = 1.0
    return still


def _outward(bones: Nodes, offsets: Int[np.ndarray, " chains_and_one"], joints: Nodes) -> Float[np.ndarray, "chains 3"]:
    """Returns the horizontal direction from the joint of each chain to its middle; forwards where there is none."""
    middles = np.add.reduceat(bones, offsets[:-1]) / np.diff(offsets)[:, None]
    way = (middles - joints) * [1.0, 0.0, 1.0]
    length = np.linalg.norm(way, axis=1, keepdims=True)
    return np.where(length > 1e-6, way / np.maximum(length, 1e-6), [0.0, 0.0, 1.0])


def _carrier(joint: int) -> int:
    """Returns the joint of the trunk that carries a chain: below the chest the lowest joint of the spine.

    A chain hangs down even if an arm is raised, and a skirt does not lean with the chest.
    """
    while JOINT_NAMES[joint] not in _TRUNK:
        joint = PARENTS[joint]
    return joint if JOINT_NAMES[joint] not in _WAIST else JOINT_NAMES.index("spine1")
