"""Lifts limbs out of the torso and out of each other, smoothly and by a little."""

import functools
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from hemline.bodies.model import BodyModel
from hemline.bodies.shape import BodyShape
from hemline.bodies.skinning import skin_points
from hemline.motions import JOINT_NAMES, Motion, Pose
from hemline.motions.arm_twist import steady_arm_twist
from hemline.motions.quaternions import angle, from_axis_angle, inverse, multiply, to_matrix

from .balls import Balls, fill_with_balls
from .untangle_kernels import PosedBalls, TurningJoints, add_overlaps, deepest_overlaps

LIMIT_DEG = 15.0
"""Largest turn of a joint of a pose, and of a motion in each pass [deg]."""
PASSES = 2
"""Number of passes over a motion: limbs that were lifted out of one place may be in another."""

TURNED = tuple(
    JOINT_NAMES.index(f"{side}_{name}") for name in ("shoulder", "elbow", "hip", "knee") for side in ("left", "right")
)
"""Joints that may be turned."""

_STIFFNESS = np.repeat([1e-3, 2e-2, 4e-3, 4e-2], 6)
"""Cost of turning shoulders, elbows, hips and knees, relative to overlap [m^2/rad^2]."""
_GAP, _GAP_RAMP = 0.012, 0.01
"""Gap between limbs that overlapped, and the overlap up to which the gap grows [m]."""
_STEPS, _DAMPING = 10, 1.0
_SMOOTHING = 0.06
"""Width of the Gaussian by which a motion's corrections are smoothed in time [s]."""
_HOLD = 2.0
"""Time for which a correction is held before and after its frame, in widths of the Gaussian, so that smoothing does not
reduce it."""


@dataclass(frozen=True, eq=False)
class Untangling:
    """A pose whose limbs were lifted out of each other.

    Attributes:
        pose: The untangled pose.
        degrees: Angle by which each joint was turned [deg].
    """

    pose: Pose
    degrees: Float[np.ndarray, " joints"]


@dataclass(frozen=True, eq=False)
class MotionUntangling:
    """A motion whose limbs were lifted out of each other.

    Attributes:
        motion: The untangled motion.
        degrees: Angle by which each joint was turned for this in each frame [deg].
    """

    motion: Motion
    degrees: Float[np.ndarray, "frames joints"]


def untangle(shaped: BodyShape, pose: Pose) -> Untangling:
    r"""Returns the nearest pose in which limbs overlap less, and how far each joint was turned.

    Minimises, by a fixed number of damped Gauss-Newton steps over small rotations $\theta$ of shoulders, elbows, hips
    and knees,

    $$\tfrac12 \sum_{\text{pairs}} f(r_a + r_b + g - |c_a - c_b|)^2 + \tfrac12 \sum_j k_j |\theta_j|^2$$

    The sum is over pairs of balls that fill the limbs, and f is a smooth ramp. The gap g grows from 0 with the overlap
    of the two limbs, so the result is continuous in the pose, and the very same pose if nothing overlaps. No joint
    turns by more than `LIMIT_DEG`. Neighbours are ignored at their crease, and so are parts of one limb (forearm on
    upper arm).

    Args:
        shaped: The body.
        pose: The pose.
    """
    turns = _turns(shaped, pose)
    rotations = _apply_turns(pose.rotations[None], turns[None])[0] if turns.any() else pose.rotations
    return Untangling(replace(pose, rotations=rotations), _degrees(turns[None])[0])


def untangle_motion(shaped: BodyShape, motion: Motion) -> MotionUntangling:
    """Untangles each pose of a motion, and smooths the corrections in time without making them smaller.

    A hand that is inside a leg for a single frame is lifted out as far as one that stays there, and starts to move out
    before. First, arms that a recording wrings are turned back about their bones, see `steady_arm_twist`.

    Args:
        shaped: The body.
        motion: The motion.
    """
    steady = done = steady_arm_twist(motion)
    for _ in range(PASSES):
        turns = np.array([_turns(shaped, done[frame]) for frame in range(len(done))])
        if not turns.any():
            break
        turns = _smooth_turns(turns, _SMOOTHING * motion.fps)
        done = replace(done, rotations=_apply_turns(done.rotations, turns).astype(np.float32))
    between = multiply(done.rotations.astype(np.float64), inverse(steady.rotations.astype(np.float64)))
    return MotionUntangling(done, np.rad2deg(angle(between)).astype(np.float32))


def _smooth_turns(turns: np.ndarray, width: float) -> np.ndarray:
    """Smooths rotation vectors (frames, turned, 3) over time; `width` is in frames.

    Lengths are replaced by their smooth hull, directions are averaged with their lengths as weights.
    """
    from scipy.ndimage import gaussian_filter1d, maximum_filter1d

    def smooth(values: np.ndarray) -> np.ndarray:
        return gaussian_filter1d(values, width, axis=0, mode="nearest")

    length = np.linalg.norm(turns, axis=2, keepdims=True)
    hull = smooth(maximum_filter1d(length, 2 * round(_HOLD * width) + 1, axis=0, mode="nearest"))
    direction = smooth(length * turns)
    return hull * direction / np.maximum(np.linalg.norm(direction, axis=2, keepdims=True), 1e-12)


def _apply_turns(rotations: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Returns local rotations (frames, joints, 4) after turns (frames, turned, 3) in the parents' frames."""
    result = rotations.astype(np.float64)
    result[:, TURNED] = multiply(from_axis_angle(turns), result[:, TURNED])
    return result


def _degrees(turns: np.ndarray) -> np.ndarray:
    degrees = np.zeros((len(turns), len(JOINT_NAMES)), dtype=np.float32)
    degrees[:, TURNED] = np.rad2deg(np.linalg.norm(turns, axis=2))
    return degrees


def _turns(shaped: BodyShape, pose: Pose) -> Float[np.ndarray, "turned 3"]:
    """Returns rotation vectors of the joints in `TURNED`, in their parents' frames; zero if nothing overlaps [rad]."""
    balls, free = fill_with_balls(shaped), np.zeros(3 * len(TURNED))
    transforms, _ = shaped.transforms_of(pose.rotations[None], pose.translation[None])
    deepest = np.zeros(balls.limb_pairs.max() + 1)
    deepest_overlaps(_pose_balls(balls, transforms[0]), deepest)
    if not deepest.any():
        return free.reshape(-1, 3)
    gaps = _GAP * np.minimum(deepest / _GAP_RAMP, 1)
    for _ in range(_STEPS):
        free -= _step(shaped, pose, balls, gaps, free)
    return free.reshape(-1, 3) * _scales(free)[:, None]


def _pose_balls(balls: Balls, transforms: np.ndarray) -> PosedBalls:
    """Returns the balls where the skin transforms (joints, 3, 4) take them."""
    centres = skin_points(transforms, balls.weight_indices, balls.weights, balls.centres)
    return PosedBalls(centres, balls.radii, balls.pairs, balls.limb_pairs)


def _step(shaped: BodyShape, pose: Pose, balls: Balls, gaps: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Returns a Gauss-Newton step of the free parameters."""
    scales = _scales(free)
    rotations = _apply_turns(pose.rotations[None], (free.reshape(-1, 3) * scales[:, None])[None]).astype(np.float32)
    transforms, joints = shaped.transforms_of(rotations, pose.translation[None])
    matrix, vector = np.diag(_STIFFNESS), _STIFFNESS * free
    above = shaped.body.parents[list(TURNED)]
    axes = transforms[0][above, :, :3] @ _from_rest(shaped.body)
    at = joints[0][list(TURNED)].astype(np.float64)
    turning = TurningJoints(at, axes, _shares(shaped), scales)
    add_overlaps(_pose_balls(balls, transforms[0]), turning, gaps, matrix, vector)
    return np.linalg.solve(matrix + _DAMPING * np.diag(np.diag(matrix)), vector)


def _scales(free: np.ndarray) -> np.ndarray:
    """Returns factors that keep each rotation vector below the limit, smoothly."""
    lengths = np.linalg.norm(free.reshape(-1, 3), axis=1)
    return 1 / np.sqrt(1 + (lengths / np.deg2rad(LIMIT_DEG)) ** 2)


@functools.lru_cache(maxsize=8)
def _from_rest(body: BodyModel) -> Float[np.ndarray, "turned 3 3"]:
    """Returns rotations from the T-pose to the template's own pose, of the parents of the joints that may turn."""
    offsets = to_matrix(body.rest_offsets[body.parents[list(TURNED)]].astype(np.float64))
    return np.ascontiguousarray(offsets.transpose(0, 2, 1))


@functools.lru_cache(maxsize=8)
def _shares(shaped: BodyShape) -> Float[np.ndarray, "balls turned"]:
    """Returns how much each ball moves with each joint that may turn, from 0 to 1."""
    balls, below = fill_with_balls(shaped), np.zeros((len(JOINT_NAMES), len(TURNED)))
    for joint, parent in enumerate(shaped.body.parents):
        below[joint] = below[parent] if parent >= 0 else 0
        if joint in TURNED:
            below[joint, TURNED.index(joint)] = 1
    return np.einsum("bi,bij->bj", balls.weights.astype(np.float64), below[balls.weight_indices])
