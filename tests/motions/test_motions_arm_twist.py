"""Straight arms that a recording wrings are turned back; nothing but the twist changes."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import hemline
from hemline import motions
from hemline.meshes import edge_strains
from hemline.motions import JOINT_NAMES, PARENTS
from hemline.motions.arm_twist import MOST_DEG, STRAIGHT_DEG, steady_arm_twist

SHOULDER, ELBOW, WRIST = (JOINT_NAMES.index(f"right_{name}") for name in ("shoulder", "elbow", "wrist"))
CLIPS = Path(__file__).resolve().parents[2] / "../shared/data/motion"


def world(motion, joint):
    """World rotation of a joint in each frame."""
    turns = Rotation.identity(len(motion))
    while joint >= 0:
        turns = Rotation.from_quat(motion.rotations[:, joint][:, [1, 2, 3, 0]]) * turns
        joint = PARENTS[joint]
    return turns


def twist_deg(motion, joint=SHOULDER):
    """Twist about x by way of rotation matrices: what is left after the shortest turn of x to where it goes."""
    turns = Rotation.from_quat(motion.rotations[:, joint][:, [1, 2, 3, 0]])
    swung = turns.apply([1.0, 0.0, 0.0])
    axis = np.cross([1.0, 0.0, 0.0], swung)
    sine, cosine = np.linalg.norm(axis, axis=1), swung[:, 0]
    swing = Rotation.from_rotvec(axis * (np.arctan2(sine, cosine) / np.maximum(sine, 1e-12))[:, None])
    return np.degrees((swing.inv() * turns).as_rotvec()[:, 0])


def bend_deg(motion):
    """Angle by which the elbow bends."""
    forearm = Rotation.from_quat(motion.rotations[:, ELBOW][:, [1, 2, 3, 0]]).apply([1.0, 0.0, 0.0])
    return np.degrees(np.arccos(np.clip(forearm[:, 0], -1, 1)))


def wrung(motion, degrees):
    """The motion as a recording that lost the twist has it: upper arm and forearm turned, the hand turned back."""
    rotations, angles = motion.rotations.astype(np.float64), np.radians(degrees)
    about = Rotation.from_rotvec(angles[:, None] * [1.0, 0.0, 0.0])
    own = {joint: Rotation.from_quat(rotations[:, joint][:, [1, 2, 3, 0]]) for joint in (SHOULDER, ELBOW, WRIST)}
    for joint, turns in (
        (SHOULDER, own[SHOULDER] * about),
        (ELBOW, about.inv() * own[ELBOW] * about),
        (WRIST, about.inv() * own[WRIST]),
    ):
        rotations[:, joint] = turns.as_quat()[:, [3, 0, 1, 2]]
    return replace(motion, rotations=rotations.astype(np.float32))


@pytest.fixture(scope="module")
def turn():
    return motions.load("turn").resample(30.0)


def straight_clip(frames=60):
    """An arm that bends by ten degrees, and rolls slowly about itself."""
    rotations = np.zeros((frames, 24, 4))
    rotations[..., 0] = 1
    roll = np.radians(np.linspace(-30, 40, frames))
    turns = Rotation.from_euler("ZX", np.stack([np.full(frames, 1.0), roll], 1))
    rotations[:, SHOULDER] = turns.as_quat()[:, [3, 0, 1, 2]]
    rotations[:, ELBOW] = Rotation.from_euler("y", np.radians(10)).as_quat()[[3, 0, 1, 2]]
    return motions.Motion(rotations, np.zeros((frames, 3)), 30.0, 0.8)


def test_a_clip_without_such_arms_is_the_same_object():
    for name in ("walk", "run", "jump", "dance", "kick"):
        motion = motions.load(name)
        assert steady_arm_twist(motion) is motion
    assert steady_arm_twist(straight_clip()).hash == straight_clip().hash


def test_unrelated_poses_are_left_as_they_are():
    """Nothing lies between two poses of different people, whatever their arms do."""
    poses = motions.varied_poses()
    assert np.abs(twist_deg(poses))[bend_deg(poses) < STRAIGHT_DEG].max() > MOST_DEG
    assert steady_arm_twist(poses) is poses


def test_joints_and_hands_stay_where_they_are(turn):
    body, steady = hemline.bodies.load("anny24").shaped(), steady_arm_twist(turn)
    for index in range(60, 110, 5):
        before, after = body.posed(turn[index]).joints, body.posed(steady[index]).joints
        np.testing.assert_allclose(after, before, atol=1e-5)
    left = (world(turn, WRIST).inv() * world(steady, WRIST)).magnitude()
    assert np.degrees(left).max() < 0.1
    others = [joint for joint, name in enumerate(JOINT_NAMES) if not name.endswith(("shoulder", "elbow", "wrist"))]
    assert np.array_equal(steady.rotations[:, others], turn.rotations[:, others])


def test_no_straight_arm_is_wrung(turn):
    steady, straight = steady_arm_twist(turn), bend_deg(turn) < STRAIGHT_DEG
    assert np.abs(twist_deg(turn)).max() > 170 and np.abs(np.diff(twist_deg(turn))).max() > 80
    assert np.abs(twist_deg(steady))[straight].max() < MOST_DEG
    assert np.abs(np.diff(twist_deg(steady))).max() < 25
    right = [SHOULDER, ELBOW, WRIST]
    assert np.array_equal(steady.rotations[~straight][:, right], turn.rotations[~straight][:, right])
    assert np.allclose(bend_deg(steady), bend_deg(turn), atol=0.01)


def test_the_twist_that_a_recording_lost_is_found_again():
    """Half a turn is added within some frames and taken back; what comes out is what there was."""
    motion = straight_clip()
    lost = np.interp(np.arange(60), [20, 24, 34, 38], [0.0, 170.0, 170.0, 0.0])
    steady = steady_arm_twist(wrung(motion, lost))
    assert np.abs(twist_deg(wrung(motion, lost)) - twist_deg(motion)).max() > 150
    assert np.abs(twist_deg(steady) - twist_deg(motion)).max() < 3
    found = Rotation.from_quat(steady.rotations[:, ELBOW][:, [1, 2, 3, 0]])
    assert np.degrees((found.inv() * Rotation.from_euler("y", np.radians(10))).magnitude()).max() < 1


@pytest.mark.parametrize("cut", [slice(None, 28), slice(28, None), slice(25, 33)])
def test_clips_that_begin_or_end_wrung(cut):
    """The nearest frames that are believed say how the arm is twisted; if there are none, it is not."""
    lost = np.interp(np.arange(60), [20, 24, 34, 38], [0.0, 170.0, 170.0, 0.0])
    steady = twist_deg(steady_arm_twist(wrung(straight_clip(), lost)[cut]))
    assert np.abs(steady).max() < 45 and np.abs(np.diff(steady)).max() < 4


def test_a_clip_shorter_than_the_margin_is_turned_back_where_it_is_wrung():
    """Twenty frames at 120 a second, wrung in the last two: the first five are farther from them than the margin."""
    lost = np.where(np.arange(60) >= 18, 170.0, 0.0)
    motion = replace(straight_clip(), fps=120.0)[:20]
    steady = steady_arm_twist(wrung(replace(straight_clip(), fps=120.0), lost)[:20])
    assert np.array_equal(steady.rotations[:5], motion.rotations[:5])
    assert np.abs(twist_deg(steady)).max() < 45


def test_a_sleeve_is_not_wrung(turn):
    body, shirt = hemline.bodies.load("anny24").shaped(), hemline.load("tshirt-light")
    longest = {}
    for untangle in (False, True):
        frames = hemline.play(shirt, body, turn[55:85], fps=30, untangle=untangle)
        strains = [edge_strains(f.vertices, shirt.garment.faces, shirt.garment.rest_edges) for f in frames]
        longest[untangle] = max(float(strain.max()) for strain in strains)
    assert longest[True] < 3.0 < longest[False]


@pytest.mark.data
@pytest.mark.parametrize("clip", ["05_05", "05_11"])
def test_recorded_dances(clip):
    path = next(CLIPS.rglob(f"{clip}.bvh"), None)
    if path is None:
        pytest.skip(f"{clip}.bvh is absent from {CLIPS}")
    motion = motions.read(path).resample(30.0)
    steady, straight = steady_arm_twist(motion), bend_deg(motion) < STRAIGHT_DEG
    assert np.abs(twist_deg(motion))[straight].max() > 150
    assert np.abs(twist_deg(steady))[straight].max() < MOST_DEG
