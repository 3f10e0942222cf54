"""Tracking of the bones: no lag at constant velocity, less tremor, the same at any frame rate."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.ropes.bones.tracker import TRACKING_SECONDS, TrackedPoints
from hemline.motions.quaternions import from_axis_angle, to_matrix

H = 1 / 30


def tracked(path: np.ndarray, dt: float, velocity=None) -> np.ndarray:
    """The tracked positions along a path (frames, points, 3)."""
    points, shown = TrackedPoints(path[0], np.zeros_like(path[0]) if velocity is None else velocity), [path[0]]
    for given in path[1:]:
        points = points.follow(given, dt)
        shown.append(points.positions)
    return np.stack(shown)


def test_a_point_of_constant_velocity_is_followed_without_lag():
    velocity = np.array([[3.0, -1.0, 0.5]])
    path = np.arange(60)[:, None, None] * H * velocity
    assert_allclose(tracked(path, H, velocity), path, atol=1e-12)
    # from rest, the lag is gone after ten time constants
    assert np.abs(tracked(path, H) - path)[round(10 * TRACKING_SECONDS / H) :].max() < 1e-3
    assert np.abs(tracked(path, H) - path).max() > 0.02


def test_it_is_critically_damped():
    """A step of a metre: both roots of the error are theta, so that r(k) / theta^k is linear in k."""
    path = np.ones((12, 1, 3))
    path[0] = 0
    theta = np.exp(-H / TRACKING_SECONDS)
    left = (path - tracked(path, H))[1:, 0, 0] / theta ** np.arange(1, 12)
    assert_allclose(np.diff(left, 2), 0, atol=1e-6)


@pytest.mark.parametrize("rate", [24, 60, 120])
def test_a_swing_is_shown_alike_at_any_frame_rate(rate):
    def swing(fps):
        at = np.arange(2 * fps + 1) / fps
        path = np.zeros((len(at), 1, 3))
        path[:, 0, 0] = 0.2 * np.sin(2 * np.pi * at)
        return tracked(path, 1 / fps)[fps::fps, 0, 0], path[fps::fps, 0, 0]

    shown, given = swing(rate)
    fine, _ = swing(480)
    assert_allclose(shown, fine, atol=0.012)  # of a swing of 20 cm at 1 Hz
    assert_allclose(fine, given, atol=0.03)


def test_tremor_is_damped_and_swing_is_not():
    random, at = np.random.default_rng(0), np.arange(300) * H
    smooth = 0.3 * np.sin(2 * np.pi * 0.8 * at)[:, None, None] * np.ones((1, 20, 3))
    noisy = smooth + 0.003 * random.normal(size=smooth.shape)
    shown = tracked(noisy, H)[60:]

    def jerk(path):
        return np.linalg.norm(np.diff(path, 3, axis=0), axis=2).mean()

    assert jerk(shown) < 0.65 * jerk(noisy[60:])
    assert np.ptp(shown[:, 0, 0]) == pytest.approx(0.6, rel=0.05)
    assert np.abs(shown - smooth[60:]).mean() < 0.012


def test_a_relocated_state_goes_on_as_if_all_had_been_there():
    random = np.random.default_rng(1)
    path = np.cumsum(random.normal(0, 0.02, (20, 5, 3)), axis=0)
    motion = RigidTransform(to_matrix(from_axis_angle(np.array([0.0, 0.7, 0.0]))), np.array([3.0, 0.5, -2.0]))
    here = TrackedPoints(path[0], np.zeros_like(path[0]))
    for given in path[1:10]:
        here = here.follow(given, H)
    there = here.relocate(motion)
    for given in path[10:]:
        here, there = here.follow(given, H), there.follow(motion.points(given), H)
    assert_allclose(there.positions, motion.points(here.positions), atol=1e-12)
    assert_allclose(there.velocities, motion.vectors(here.velocities), atol=1e-12)
