"""Arms lifted off the torso."""

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies.lifted_arms import HANGING_DEG, LIFT_DEG, RAISED_DEG, lift_pose_arms
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle, multiply, rotate

LEFT, RIGHT = JOINT_NAMES.index("left_shoulder"), JOINT_NAMES.index("right_shoulder")


def arms_at(degrees: float) -> Pose:
    """The T-pose with both arms this far from hanging straight down, sideways [deg]."""
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (24, 1))
    rotations[LEFT] = from_axis_angle(np.array([0.0, 0.0, np.deg2rad(degrees - 90)]))
    rotations[RIGHT] = from_axis_angle(np.array([0.0, 0.0, np.deg2rad(90 - degrees)]))
    return Pose(rotations, np.zeros(3))


def lift_deg(angle_deg):
    """Returns the angle by which to lift an upper arm that is at a given angle from hanging straight down [deg]."""
    fraction = np.clip((angle_deg - HANGING_DEG) / (RAISED_DEG - HANGING_DEG), 0.0, 1.0)
    return LIFT_DEG * (1 - fraction * fraction * (3 - 2 * fraction))


def hanging(pose: Pose) -> list[float]:
    """Angle of each upper arm from straight down, on a body [deg]."""
    shaped = bodies.load("anny24").shaped()
    joints = shaped.posed(pose).joints
    found = []
    for shoulder in (LEFT, RIGHT):
        arm = joints[shoulder + 2] - joints[shoulder]
        found.append(float(np.rad2deg(np.arccos(-arm[1] / np.linalg.norm(arm)))))
    return found


@pytest.mark.parametrize("degrees", [5.0, 20.0, 45.0, 60.0, 80.0, 150.0])
def test_an_arm_that_hangs_is_lifted_and_a_raised_one_is_not(degrees):
    before, after = hanging(arms_at(degrees)), hanging(lift_pose_arms(arms_at(degrees)))
    np.testing.assert_allclose(np.subtract(after, before), lift_deg(degrees), atol=0.2)
    assert lift_deg(degrees) == (
        LIFT_DEG if degrees <= HANGING_DEG else 0 if degrees >= RAISED_DEG else lift_deg(degrees)
    )


def test_arms_keep_their_order_and_nothing_jumps():
    angles = np.arange(0.0, 180.0, 0.5)
    lifted = angles + [lift_deg(angle) for angle in angles]
    assert (np.diff(lifted) > 0.1).all() and (np.diff(lifted) < 0.6).all()


def test_all_other_joints_stay():
    pose = arms_at(10.0)
    lifted = lift_pose_arms(pose)
    others = np.setdiff1d(np.arange(24), [LEFT, RIGHT])
    np.testing.assert_array_equal(lifted.rotations[others], pose.rotations[others])
    np.testing.assert_array_equal(lifted.translation, pose.translation)


def test_the_kernel_equals_plain_numpy():
    """Poses of all directions, arms straight down and straight up among them."""
    random, sideways = np.random.default_rng(0), np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    extremes = [arms_at(degrees).rotations.astype(np.float64) for degrees in (0.0, 180.0)]
    for rotations in [*random.normal(size=(50, 24, 4)), *extremes]:
        rotations = rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
        arms = Pose(rotations, np.zeros(3)).rotations[[LEFT, RIGHT]].astype(np.float64)
        angles = np.rad2deg(np.arccos(np.clip(-rotate(arms, sideways)[:, 1], -1.0, 1.0)))
        turns = np.deg2rad(lift_deg(angles))[:, None] * np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
        wanted = multiply(from_axis_angle(turns), arms)
        found = lift_pose_arms(Pose(rotations, np.zeros(3))).rotations[[LEFT, RIGHT]]
        np.testing.assert_allclose(found, wanted, atol=3e-7)
