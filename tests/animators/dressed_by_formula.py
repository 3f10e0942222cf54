"""A shirt whose settled states follow a formula: anchors without a simulation, for tests of AgentDress."""

from functools import cache
from pathlib import Path

import numpy as np

from hemline import bodies, garments
from hemline.animators.agentdress.binding import Binding
from hemline.bodies.lifted_arms import lifted_arms
from hemline.datasets import Dataset, Take, create
from hemline.garments import coarser_garment
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES, Motion, Pose
from hemline.motions.pose_clusters import without_heading
from hemline.motions.quaternions import from_axis_angle, multiply, to_matrix

ELBOW, SHOULDER, SPINE, RIGHT_SHOULDER = (
    JOINT_NAMES.index(name) for name in ("left_elbow", "left_shoulder", "spine2", "right_shoulder")
)
BEYOND = 4
"""A beta that is 0 in all shapes of anchors, and moves the skin under the garment, and the garment."""
SHAPES = [(), (-2.0,), (-1.0,), (1.0,), (2.0,), (0.0, -2.0), (0.0, -1.0), (0.0, 1.0), (0.0, 2.0)]


@cache
def body():
    return bodies.load("anny24").shaped()


@cache
def shirt():
    """Of 630 vertices."""
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    return garment


@cache
def binding() -> Binding:
    upright = body().posed(tpose())
    # anywhere near the body: the formula begins from there
    rest = Binding.of(shirt().vertices, shirt().faces, body().posed(body().rest_pose))
    return Binding.of(rest.skin(upright.transforms, shirt().vertices), shirt().faces, upright)


def tpose() -> Pose:
    return Pose(np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), body().rest_pose.translation)


def turned(*turns: tuple[int, tuple[float, float, float]]) -> Pose:
    """The rest pose with joints turned [rad]."""
    pose = body().rest_pose
    rotations = pose.rotations.astype(np.float64)
    for joint, vector in turns:
        rotations[joint] = multiply(rotations[joint], from_axis_angle(np.asarray(vector)))
    return Pose(rotations, pose.translation)


def random_pose(number: int) -> Pose:
    """Shoulder, elbow and spine turned by chance."""
    random = np.random.default_rng(number)
    return turned(*((joint, tuple(random.uniform(-0.5, 0.5, 3))) for joint in (ELBOW, SHOULDER, SPINE)))


def anchored(pose: Pose) -> Pose:
    """The pose in which a garment is settled for it: arms lifted, heading left out."""
    lifted = lifted_arms(pose)
    return Pose(without_heading(lifted.rotations[None])[0], body().rest_pose.translation)


def base() -> np.ndarray:
    """The garment that skinning carries, in the rest pose of its body (verts, 3) [m]."""
    return shirt().vertices.astype(np.float64)


def formula(pose: Pose, betas) -> np.ndarray:
    """What is added in the turned frames (verts, 3) [m]: what arms and spine do, and what the shape does.

    In a mirror it is what the mirrored pose adds.
    """
    shares, result = binding().dense_weights(), np.zeros_like(base())
    for joint in (SHOULDER, RIGHT_SHOULDER, SPINE):
        matrix = to_matrix(pose.rotations[joint].astype(np.float64))
        result += 0.03 * shares[:, [joint]] * (matrix[:, 1] + matrix[:, 2])
    betas = np.pad(np.asarray(betas, np.float64), (0, BEYOND + 1))[: BEYOND + 1]
    outward = base() - base().mean(axis=0)
    # the larger the body, the more a raised arm draws
    for joint, sign in ((SHOULDER, 1.0), (RIGHT_SHOULDER, -1.0)):
        drawn = sign * to_matrix(pose.rotations[joint].astype(np.float64))[0, 1]
        result += 0.1 * betas[0] * drawn * shares[:, [joint]] * outward
    result += 0.03 * betas[BEYOND] * outward[:, [2]] * [0.0, 0.0, 1.0]
    return result + 0.05 * betas[0] * outward + 0.02 * betas[1] ** 2 * outward[:, [1]] * [0.0, 1.0, 0.0]


def settled(pose: Pose, betas=()) -> np.ndarray:
    """The garment in the world (verts, 3) [m], float32: what it is with arms lifted, and arms handed back."""
    shaped = body().body.shaped(np.asarray(betas, np.float32))
    return binding().skin(shaped.posed(pose).transforms, base(), formula(anchored(pose), betas)).astype(np.float32)


def laid(pose: Pose, betas=()) -> np.ndarray:
    """The garment in the world (verts, 3) [m], float32, in a pose as it stands."""
    shaped = body().body.shaped(np.asarray(betas, np.float32))
    return binding().skin(shaped.posed(pose).transforms, base(), formula(pose, betas)).astype(np.float32)


def anchor(pose: Pose, betas=(), derivatives=None) -> Take:
    shaped = body().body.shaped(np.asarray(betas, np.float32))
    motion = Motion(pose.rotations[None], pose.translation[None], fps=30.0, leg_length=shaped.leg_length)
    inputs = {"garment": shirt().hash, "pose": pose.hash, "betas": list(betas), "derivatives": bool(derivatives)}
    still = np.zeros(1, bool), np.zeros(1, np.int32)
    vertices = laid(pose, betas)[None]
    return Take("anchor", vertices, motion, shaped.betas, *still, {}, inputs, derivatives=derivatives or {})


def derivatives(pose: Pose | None = None) -> dict[str, np.ndarray]:
    """By turns of each joint about the axes of its own frame, in a pose (left out: the T-pose), by differences."""
    found, step, here = {}, 1e-3, pose or tpose()
    for joint in range(JOINT_COUNT):
        for axis in range(3):
            moved = []
            for sign in (1, -1):
                rotations = here.rotations.astype(np.float64)
                rotations[joint] = multiply(rotations[joint], from_axis_angle(sign * step * np.eye(3)[axis]))
                moved.append(laid(Pose(rotations, here.translation)).astype(np.float64))
            found[f"turn.{joint}.{axis}"] = ((moved[0] - moved[1]) / (2 * step)).astype(np.float32)
    return found


def random_body(number: int) -> tuple[float, ...]:
    """Of two betas that the anchors know, and one that they do not."""
    drawn = np.random.default_rng(number).normal(size=3)
    return (float(drawn[0]), float(drawn[1]), *[0.0] * (BEYOND - 2), float(drawn[2]))


def dataset(
    folder: Path, anchors: int, singles: int = 0, shapes=SHAPES, random_bodies: int = 0, rigged: int = 0
) -> Dataset:
    """Anchors on all shapes, poses on the mean one alone, random bodies in poses of anchors; some with derivatives."""
    made = create(folder, shirt())
    made.add(anchor(tpose(), (), derivatives()))
    for number in range(anchors + singles):
        for betas in shapes if number < anchors else [()]:
            made.add(anchor(anchored(random_pose(number)), betas))
    for number in range(random_bodies):
        made.add(anchor(anchored(random_pose(number % anchors)), random_body(number)))
    for number in range(rigged):
        pose = anchored(random_pose(number))
        made.add(anchor(pose, (), derivatives(pose)))
    return made
