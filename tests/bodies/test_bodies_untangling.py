"""Limbs lifted out of each other: less overlap, little change, nothing where nothing overlaps, no pops."""

from pathlib import Path

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies import overlapping, untangle, untangle_motion
from hemline.bodies.untangling.balls import fill_with_balls
from hemline.bodies.untangling.untangle_kernels import (
    RAMP,
    PosedBalls,
    TurningJoints,
    add_overlaps,
    deepest_overlaps,
)
from hemline.bodies.untangling.untangling import LIMIT_DEG, PASSES, TURNED
from hemline.motions import JOINT_NAMES, read
from hemline.motions.quaternions import angle, inverse, multiply
from tests.bodies.body_samples import arms_down, clip_of, overlap_percent, random_pose, t_pose, turned

CLIPS = Path(__file__).resolve().parents[2] / "../shared/data/motion"


@pytest.fixture(scope="module")
def shaped():
    return bodies.load().shaped()


def test_balls_lie_within_and_fill_the_body(shaped):
    from scipy.spatial import KDTree

    balls = fill_with_balls(shaped)
    distance, _ = KDTree(shaped.vertices).query(balls.centres)
    assert (balls.radii < distance + 2e-3).all()
    below = np.linalg.norm(shaped.vertices[:, None] - balls.centres[None], axis=2) - balls.radii
    assert np.median(below.min(axis=1)) < 0.01
    np.testing.assert_allclose(balls.weights.sum(axis=1), 1, atol=1e-6)


def test_a_pose_without_overlap_is_left_as_it_is(shaped):
    for pose in (t_pose(), shaped.rest_pose, arms_down(lift=0.6)):
        done = untangle(shaped, pose)
        assert np.array_equal(done.pose.rotations, pose.rotations) and not done.degrees.any()


def test_hanging_arms_are_lifted_out(shaped):
    pose = arms_down(lift=0.05)
    done = untangle(shaped, pose)
    before, after = (overlapping(shaped.posed(each)).mean() for each in (pose, done.pose))
    assert before > 0.005 and after < 0.2 * before
    assert shaped.untangle(pose).hash == done.pose.hash


def test_legs_are_parted(shaped):
    pose = turned(t_pose(), left_hip=(0, 0, -0.12), right_hip=(0, 0, 0.12))
    before, after = (overlapping(shaped.posed(each)).mean() for each in (pose, untangle(shaped, pose).pose))
    assert before > 0.002 and after < 0.5 * before


@pytest.mark.parametrize("seed", range(4))
def test_the_change_is_what_is_stated_and_below_the_limit(shaped, seed):
    pose = random_pose(seed, 0.7)
    done = untangle(shaped, pose)
    between = np.rad2deg(angle(multiply(done.pose.rotations, inverse(pose.rotations)).astype(np.float64)))
    np.testing.assert_allclose(between, done.degrees, atol=0.05)
    assert done.degrees.max() <= LIMIT_DEG
    assert not np.delete(done.degrees, TURNED).any()
    assert np.array_equal(done.pose.translation, pose.translation)


def test_no_pop_as_an_arm_sinks_in(shaped):
    """The correction is continuous where the first balls meet: finer steps, smaller changes."""
    changes = []
    for steps in (30, 120):
        lifts = np.linspace(0.3, 0.08, steps)
        degrees = np.array([untangle(shaped, arms_down(lift)).degrees for lift in lifts])
        assert degrees[0].max() == 0 and degrees[-1].max() > 5
        changes.append(np.abs(np.diff(degrees, axis=0)).max())
    assert changes[0] < 2.0 and changes[1] < 0.4 * changes[0]


def test_a_motion_is_untangled_smoothly(shaped):
    lifts = 0.3 * np.abs(np.sin(np.linspace(0, 3 * np.pi, 40)))
    motion = clip_of([arms_down(lift) for lift in lifts])
    done = untangle_motion(shaped, motion)
    assert overlap_percent(shaped, done.motion).mean() < 0.3 * overlap_percent(shaped, motion).mean()
    each = np.array([untangle(shaped, motion[frame]).degrees for frame in range(len(motion))])
    assert np.abs(np.diff(done.degrees, n=2, axis=0)).max() < np.abs(np.diff(each, n=2, axis=0)).max()
    assert done.degrees.shape == (40, len(JOINT_NAMES)) and done.motion.hash == shaped.untangle_motion(motion).hash


def test_a_motion_without_overlap_is_the_same_object(shaped):
    motion = clip_of([t_pose(), t_pose()])
    assert untangle_motion(shaped, motion).motion is motion


def energy(centres, radii, pairs, gaps, ramp):
    depth = radii[pairs].sum(axis=1) + gaps - np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    residual = np.where(depth < 0, 0, np.where(depth < ramp, depth**2 / (2 * ramp), depth - ramp / 2))
    return 0.5 * np.sum(residual**2)


def test_system_of_overlaps_is_the_gradient_of_their_energy():
    """The kernel's vector against central differences over rotations of one joint that moves the first ball."""
    rng = np.random.default_rng(0)
    centres, radii = rng.normal(scale=0.1, size=(6, 3)), rng.uniform(0.05, 0.1, 6)
    pairs = np.array([[a, b] for a in range(3) for b in range(3, 6)], np.int32)
    groups, gaps = np.zeros(9, np.int32), np.array([0.01])
    joint, shares = np.array([[0.3, -0.1, 0.2]]), np.zeros((6, 1))
    shares[:3] = 1
    matrix, vector = np.zeros((3, 3)), np.zeros(3)
    turning = TurningJoints(joint, np.eye(3)[None], shares, np.ones(1))
    add_overlaps(PosedBalls(centres, radii, pairs, groups), turning, gaps, matrix, vector)
    step = 1e-6
    for axis in range(3):
        energies = []
        for sign in (1, -1):
            moved = centres.copy()
            moved[:3] += sign * step * np.cross(np.eye(3)[axis], centres[:3] - joint[0])
            energies.append(energy(moved, radii, pairs, gaps, RAMP))
        assert vector[axis] == pytest.approx((energies[0] - energies[1]) / (2 * step), rel=1e-4, abs=1e-9)
    assert np.allclose(matrix, matrix.T) and np.linalg.eigvalsh(matrix).min() > -1e-12


def test_deepest_overlap_twin(shaped):
    rng = np.random.default_rng(1)
    centres, radii = rng.normal(scale=0.1, size=(8, 3)), rng.uniform(0.02, 0.08, 8)
    pairs, groups = (
        np.array([[a, b] for a in range(4) for b in range(4, 8)], np.int32),
        np.repeat([0, 1], 8).astype(np.int32),
    )
    deepest = np.empty(2)
    deepest_overlaps(PosedBalls(centres, radii, pairs, groups), deepest)
    depth = radii[pairs].sum(axis=1) - np.linalg.norm(centres[pairs[:, 0]] - centres[pairs[:, 1]], axis=1)
    np.testing.assert_allclose(deepest, np.maximum(depth.reshape(2, 8).max(axis=1), 0), atol=1e-12)


@pytest.mark.data
@pytest.mark.parametrize("clip", ["02_01", "61_01"])
def test_recorded_clips_overlap_less(shaped, clip):
    path = CLIPS / f"{clip}.bvh"
    if not path.exists():
        pytest.skip(f"{path} is absent")
    motion = shaped.placed(read(path).resample(15))[:45]
    done = untangle_motion(shaped, motion)
    before, after = (overlap_percent(shaped, each).mean() for each in (motion, done.motion))
    assert before > 0.5 and after < 0.05 * before and done.degrees.max() <= PASSES * LIMIT_DEG


def test_an_arm_that_is_in_for_one_frame_is_lifted_as_far_as_one_that_stays(shaped):
    pose = arms_down(lift=0.05)
    alone = untangle(shaped, pose).degrees.max()
    motion = clip_of([arms_down(lift=0.3)] * 10 + [pose] + [arms_down(lift=0.3)] * 10)
    done = untangle_motion(shaped, motion)
    assert overlap_percent(shaped, motion)[10] > 0.3
    assert overlap_percent(shaped, done.motion)[10] < 0.1 * overlap_percent(shaped, motion)[10]
    # it begins to give way before, and without a jerk
    lifted = done.degrees.max(axis=1)
    assert lifted[10] > 0.95 * alone and lifted[7] > 0.5 * alone and lifted[0] < 0.01
    assert np.abs(np.diff(lifted, n=2)).max() < 0.1 * alone
