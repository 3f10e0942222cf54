"""A shirt whose drapes follow a formula: anchors without a simulation, for tests of AgentDress."""

from functools import cache
from pathlib import Path

import numpy as np

from hemline import bodies, garments
from hemline.animators.agentdress.binding import Binding
from hemline.bodies.lifted_arms import lift_pose_arms
from hemline.datasets import Dataset, Take, create
from hemline.garments import coarser_garment
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, Motion, Pose
from hemline.motions.pose_clusters import without_heading
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix

ELBOW, SHOULDER, SPINE, RIGHT_SHOULDER = (
    JOINT_NAMES.index(name) for name in ("left_elbow", "left_shoulder", "spine2", "right_shoulder")
)
UNKNOWN_BETA = 4
"""Index of a beta that is 0 in all anchors, and moves garment and skin."""
SHAPES = [(), (-2.0,), (-1.0,), (1.0,), (2.0,), (0.0, -2.0), (0.0, -1.0), (0.0, 1.0), (0.0, 2.0)]


@cache
def body():
    return bodies.load("anny24").shaped()


@cache
def shirt():
    """Returns the light T-shirt with 630 vertices."""
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    return garment


@cache
def binding() -> Binding:
    upright = body().posed(t_pose())
    # the formula starts from any garment near the body
    rest = Binding.of(shirt().vertices, shirt().faces, body().posed(body().rest_pose))
    return Binding.of(rest.skin(upright.transforms, shirt().vertices), shirt().faces, upright)


def t_pose() -> Pose:
    return Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), body().rest_pose.translation)


def turn_joints(*turns: tuple[int, tuple[float, float, float]]) -> Pose:
    """Returns the rest pose with rotated joints [rad]."""
    pose = body().rest_pose
    rotations = pose.rotations.astype(np.float64)
    for joint, vector in turns:
        rotations[joint] = multiply(rotations[joint], from_axis_angle(np.asarray(vector)))
    return Pose(rotations, pose.translation)


def random_pose(number: int) -> Pose:
    """Returns a pose with random rotations of shoulder, elbow and spine."""
    random = np.random.default_rng(number)
    return turn_joints(*((joint, tuple(random.uniform(-0.5, 0.5, 3))) for joint in (ELBOW, SHOULDER, SPINE)))


def anchor_pose(pose: Pose) -> Pose:
    """Returns the anchor pose for a pose: arms lifted, without heading."""
    lifted = lift_pose_arms(pose)
    return Pose(without_heading(lifted.rotations[None])[0], body().rest_pose.translation)


def rest_garment() -> np.ndarray:
    """Returns the skinned garment in the rest pose of its body (verts, 3) [m]."""
    return shirt().vertices.astype(np.float64)


def formula(pose: Pose, betas) -> np.ndarray:
    """Returns the offsets from the skinned garment (verts, 3) [m]: effects of arms, spine and shape.

    The mirror image of the offsets belongs to the mirrored pose.
    """
    weights, result = binding().dense_weights(), np.zeros_like(rest_garment())
    for joint in (SHOULDER, RIGHT_SHOULDER, SPINE):
        matrix = to_matrix(pose.rotations[joint].astype(np.float64))
        result += 0.03 * weights[:, [joint]] * (matrix[:, 1] + matrix[:, 2])
    betas = np.pad(np.asarray(betas, np.float64), (0, UNKNOWN_BETA + 1))[: UNKNOWN_BETA + 1]
    outward = rest_garment() - rest_garment().mean(axis=0)
    # a raised arm pulls more on a larger body
    for joint, sign in ((SHOULDER, 1.0), (RIGHT_SHOULDER, -1.0)):
        pull = sign * to_matrix(pose.rotations[joint].astype(np.float64))[0, 1]
        result += 0.1 * betas[0] * pull * weights[:, [joint]] * outward
    result += 0.03 * betas[UNKNOWN_BETA] * outward[:, [2]] * [0.0, 0.0, 1.0]
    return result + 0.05 * betas[0] * outward + 0.02 * betas[1] ** 2 * outward[:, [1]] * [0.0, 1.0, 0.0]


def lifted_garment(pose: Pose, betas=()) -> np.ndarray:
    """Returns the garment in the world (verts, 3) [m], float32, with the offsets of the pose with lifted arms."""
    shaped = body().body.shaped(np.asarray(betas, np.float32))
    return (
        binding()
        .skin(shaped.posed(pose).transforms, rest_garment(), formula(anchor_pose(pose), betas))
        .astype(np.float32)
    )


def garment_in_pose(pose: Pose, betas=()) -> np.ndarray:
    """Returns the garment in the world (verts, 3) [m], float32, with the offsets of the pose itself."""
    shaped = body().body.shaped(np.asarray(betas, np.float32))
    return binding().skin(shaped.posed(pose).transforms, rest_garment(), formula(pose, betas)).astype(np.float32)


def anchor(pose: Pose, betas=(), derivatives=None) -> Take:
    shaped = body().body.shaped(np.asarray(betas, np.float32))
    motion = Motion(pose.rotations[None], pose.translation[None], fps=30.0, leg_length=shaped.leg_length)
    inputs = {"garment": shirt().hash, "pose": pose.hash, "betas": list(betas), "derivatives": bool(derivatives)}
    still = np.zeros(1, bool), np.zeros(1, np.int32)
    vertices = garment_in_pose(pose, betas)[None]
    return Take("anchor", vertices, motion, shaped.betas, *still, {}, inputs, derivatives=derivatives or {})


def derivatives(pose: Pose | None = None) -> dict[str, np.ndarray]:
    """Returns derivatives by rotations about the axes of each joint frame, by finite differences; default: T-pose."""
    result, step, pose = {}, 1e-3, pose or t_pose()
    for joint in range(JOINT_COUNT):
        for axis in range(3):
            sides = []
            for sign in (1, -1):
                rotations = pose.rotations.astype(np.float64)
                rotations[joint] = multiply(rotations[joint], from_axis_angle(sign * step * np.eye(3)[axis]))
                sides.append(garment_in_pose(Pose(rotations, pose.translation)).astype(np.float64))
            result[f"turn.{joint}.{axis}"] = ((sides[0] - sides[1]) / (2 * step)).astype(np.float32)
    return result


def random_body(number: int) -> tuple[float, ...]:
    """Returns random values of two betas that anchors have, and of one that they do not have."""
    numbers = np.random.default_rng(number).normal(size=3)
    return (float(numbers[0]), float(numbers[1]), *[0.0] * (UNKNOWN_BETA - 2), float(numbers[2]))


def make_dataset(
    folder: Path, anchors: int, singles: int = 0, shapes=SHAPES, random_bodies: int = 0, rigged: int = 0
) -> Dataset:
    """Makes anchors on all shapes, single poses, random bodies in poses of anchors, and anchors with derivatives."""
    result = create(folder, shirt())
    result.add(anchor(t_pose(), (), derivatives()))
    for number in range(anchors + singles):
        for betas in shapes if number < anchors else [()]:
            result.add(anchor(anchor_pose(random_pose(number)), betas))
    for number in range(random_bodies):
        result.add(anchor(anchor_pose(random_pose(number % anchors)), random_body(number)))
    for number in range(rigged):
        pose = anchor_pose(random_pose(number))
        result.add(anchor(pose, (), derivatives(pose)))
    return result
