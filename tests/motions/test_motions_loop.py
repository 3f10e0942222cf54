import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.errors import BadMotion
from hemline.motions import Motion
from hemline.motions.loop import seamless
from tests.motions.bvh_samples import quaternions


def walk(period_s=0.8, seconds=2.0, fps=120.0, turn=0.4, noise=0.0):
    """Legs and arms that swing, along a circle: heading turns by `turn` [rad/s], speed is 1.5 m/s."""
    times = np.arange(round(seconds * fps)) / fps
    phase = 2 * np.pi * times / period_s
    rotations = np.zeros((len(times), 24, 4))
    rotations[..., 0] = 1
    for joint, sign in ((1, 1), (2, -1), (16, -1), (17, 1)):
        swing = 0.5 * sign * np.sin(phase) + noise * times
        rotations[:, joint] = quaternions(Rotation.from_euler("x", swing[:, None]))
    heading = turn * times
    rotations[:, 0] = quaternions(Rotation.from_euler("YX", np.stack([heading, 0.05 * np.cos(2 * phase)], axis=1)))
    radius = 1.5 / turn
    bounce = 0.03 * np.cos(2 * phase)
    places = np.stack([radius * (1 - np.cos(heading)), 0.9 + bounce, radius * np.sin(heading)], axis=1)
    return Motion(rotations, places, fps, 0.8, name="walk")


def angular_velocities(motion):
    rotations = motion.rotations.astype(float)[..., [1, 2, 3, 0]]
    before, after = (Rotation.from_quat(part.reshape(-1, 4)) for part in (rotations[:-1], rotations[1:]))
    return (after * before.inv()).as_rotvec().reshape(-1, 24, 3) * motion.fps


def test_a_periodic_walk_on_a_circle_goes_on_as_it_is():
    """The cycle that is found is the true one, and the loop is the walk itself, continued."""
    clip = walk()
    loop = seamless(clip, seconds=4, fps=30)
    start = int(loop.notes[-1].rpartition("frame ")[2].split(",")[0])
    expected = walk(seconds=9)[start::4][: len(loop)]
    assert "cycle of 0.800 s" in loop.notes[-1]
    assert loop.seconds + 1 / 30 >= 4
    dots = np.abs(np.sum(loop.rotations * expected.rotations, axis=-1))
    assert np.degrees(2 * np.arccos(np.clip(dots, 0, 1))).max() < 0.1
    assert np.allclose(loop.translations, expected.translations, atol=2e-3)


def test_a_loop_is_a_whole_number_of_cycles_at_the_lower_rate():
    loop = seamless(walk(period_s=91 / 120), seconds=4, fps=30)
    assert len(loop) * 4 % 91 == 0


def test_a_walk_that_drifts_is_blended_smoothly():
    """Where the ends of the cycle do not meet, neither velocity nor acceleration jumps more than inside the clip."""
    clip = walk(noise=0.1)
    loop = seamless(clip, seconds=3, fps=120)
    fast, inside = angular_velocities(loop), angular_velocities(clip)
    assert np.abs(fast).max() < 1.35 * np.abs(inside).max()
    assert np.abs(np.diff(fast, axis=0)).max() < 2 * np.abs(np.diff(inside, axis=0)).max()


def seam_share(values, period):
    """The largest value near seams, as a share of the largest elsewhere."""
    frames = np.arange(len(values))
    near = np.zeros(len(values), bool)
    for seam in range(period, len(values), period):
        near |= np.abs(frames - seam) <= 1
    return values[near].max() / values[~near].max()


def test_a_walk_that_gets_faster_does_not_jerk_forward_where_it_begins_anew():
    clip = walk()
    times = np.arange(len(clip)) / clip.fps
    hurried = clip.translations + np.outer(0.3 * times**2, [0, 0, 1]).astype(np.float32)
    faster = Motion(clip.rotations, hurried, clip.fps, 0.8, name="walk")
    loop = seamless(faster, seconds=3, fps=120)
    velocity, inside = (np.diff(each.translations, axis=0) * each.fps for each in (loop, faster))
    assert np.abs(np.diff(velocity, axis=0)).max() < 2 * np.abs(np.diff(inside, axis=0)).max()


def test_the_shipped_run_has_no_seam():
    run = motions.load("run")
    assert run.seconds >= 4
    cycle = float(run.notes[-1].partition("cycle of ")[2].split()[0])
    rounds = int(run.notes[-1].split()[0])
    period = len(run) / rounds
    assert period == pytest.approx(cycle * 30)
    spin = angular_velocities(run)
    speed = np.diff(run.translations.astype(float), axis=0) * run.fps
    for values in (spin, speed):
        velocity = np.linalg.norm(values, axis=-1).reshape(len(values), -1).max(axis=1)
        acceleration = np.linalg.norm(np.diff(values, axis=0), axis=-1).reshape(len(values) - 1, -1).max(axis=1)
        assert seam_share(velocity, round(period)) < 1.05
        assert seam_share(acceleration, round(period)) < 1.05


def test_the_shipped_run_runs():
    """It advances at a run's pace, forward, and the last frame leads into the first, moved on by the cycles."""
    run = motions.load("run")
    travelled = np.linalg.norm((run.translations[-1] - run.translations[0])[[0, 2]])
    assert 2.0 < travelled / run.seconds < 5.0
    spin = angular_velocities(run)
    last = Rotation.from_quat(run.rotations[-1, 1:][:, [1, 2, 3, 0]])
    first = Rotation.from_quat(run.rotations[0, 1:][:, [1, 2, 3, 0]])
    wrap = (first * last.inv()).magnitude() * run.fps
    assert (wrap < 1.05 * np.linalg.norm(spin[:, 1:], axis=-1).max(axis=0) + 1e-3).all()


def test_clips_that_cannot_be_looped_are_refused():
    with pytest.raises(BadMotion, match="'walk' is too short for a cycle; got 0.49 s"):
        seamless(walk(seconds=0.5), seconds=4, fps=30)
    with pytest.raises(BadMotion, match="fps must divide the 120 of 'walk'; got 50"):
        seamless(walk(), seconds=4, fps=50)
