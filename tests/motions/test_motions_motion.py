import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from hemline.errors import BadMotion
from hemline.motions import JOINT_NAMES, PARENTS, Motion, Pose
from tests.motions.bvh_samples import quaternions


def make_motion(frames=9, fps=30.0, **changes):
    turns = Rotation.random(frames * 24, rng=np.random.default_rng(7))
    fields = {
        "rotations": quaternions(turns).reshape(frames, 24, 4),
        "translations": np.random.default_rng(8).normal(size=(frames, 3)),
        "fps": fps,
        "leg_length": 0.8,
        "name": "sample",
    }
    return Motion(**(fields | changes))


def test_parents_come_before_their_children_and_mirror():
    assert all(parent < joint for joint, parent in enumerate(PARENTS))
    for joint, name in enumerate(JOINT_NAMES):
        if name.startswith("left_"):
            other = JOINT_NAMES.index(name.replace("left", "right"))
            above = JOINT_NAMES[PARENTS[joint]].replace("left", "right")
            assert JOINT_NAMES[PARENTS[other]] == above


def test_a_motion_is_made_of_its_poses():
    motion = make_motion()
    assert len(motion) == 9
    assert motion.seconds == pytest.approx(8 / 30)
    pose = motion[-1]
    assert isinstance(pose, Pose)
    assert np.array_equal(pose.rotations, motion.rotations[8])
    assert pose.rotations.dtype == pose.translation.dtype == np.float32
    assert motion[2:5][0].hash == motion[2].hash
    assert motion[::2].fps == 15
    with pytest.raises(IndexError):
        motion[9]


def test_at_is_slerp_and_stays_within_the_clip():
    motion = make_motion()
    pose = motion.at(2.3 / 30)
    for joint in range(24):
        ends = Rotation.from_quat(motion.rotations[2:4, joint][:, [1, 2, 3, 0]])
        expected = Slerp([0, 1], ends)([0.3])
        turned = Rotation.from_quat(pose.rotations[joint][[1, 2, 3, 0]])
        assert (turned * expected[0].inv()).magnitude() < 1e-5
    assert np.allclose(pose.translation, 0.7 * motion.translations[2] + 0.3 * motion.translations[3], atol=1e-6)
    assert np.allclose(motion.at(-1).rotations, motion[0].rotations, atol=1e-6)
    assert np.allclose(motion.at(99).translation, motion[8].translation)


def test_resampled_keeps_the_frames_that_both_rates_have():
    motion = make_motion(frames=13, fps=120.0)
    slow = motion.resample(30)
    assert (len(slow), slow.fps) == (4, 30)
    assert np.allclose(slow.translations, motion.translations[::4], atol=1e-6)
    dots = np.abs(np.sum(slow.rotations * motion.rotations[::4], axis=-1))
    assert np.allclose(dots, 1, atol=1e-6)
    assert len(motion.resample(240)) == 25
    assert motion.resample(120) is motion
    assert motion[:1].resample(30).fps == 30


def test_hash_is_of_what_moves_and_not_of_names():
    motion = make_motion()
    assert motion.hash == make_motion(name="other").hash
    assert motion.hash != make_motion(fps=31).hash
    assert motion.hash != make_motion(translations=motion.translations + np.float32(1e-6)).hash
    again = Motion(motion.rotations, motion.translations, motion.fps, motion.leg_length)
    assert again.hash == motion.hash, "what was normalised once is not touched again"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rotations": np.zeros((9, 23, 4))}, r"rotations must be \(9, 24, 4\)"),
        ({"translations": np.zeros((8, 3))}, r"translations \(9, 3\)"),
        ({"translations": np.full((9, 3), np.nan)}, "must be finite"),
        ({"rotations": np.full((9, 24, 4), np.inf)}, "must be finite"),
        ({"rotations": np.ones((9, 24, 4))}, "unit quaternions; got one of length 2"),
        ({"rotations": np.zeros((0, 24, 4)), "translations": np.zeros((0, 3))}, "must have a frame"),
        ({"fps": 0}, "motion 'sample' must have from 1 to 1000 frames a second; got 0"),
        ({"leg_length": np.nan}, "leg_length of motion 'sample' must be positive"),
    ],
)
def test_what_is_no_motion_is_refused(changes, message):
    with pytest.raises(BadMotion, match=message):
        make_motion(**changes)


def test_bad_rates_and_stretches_are_refused():
    motion = make_motion()
    with pytest.raises(BadMotion, match="must be positive; got -1"):
        motion.resample(-1)
    with pytest.raises(BadMotion, match="must have from 1 to 1000 frames a second; got 2000"):
        motion.resample(2000)
    with pytest.raises(BadMotion, match="must have from 1 to 1000 frames a second; got 0.3"):
        motion[::100]
    with pytest.raises(BadMotion, match="may have 432000 frames at 1000 a second; got 1000001 for 1000 s; cut it"):
        make_motion(frames=1001, fps=1.0).resample(1000)
    with pytest.raises(BadMotion, match="must go forward; got step -1"):
        motion[::-1]
    with pytest.raises(BadMotion, match="must have a frame"):
        motion[5:5]


def test_a_pose_of_another_skeleton_is_refused():
    with pytest.raises(BadMotion, match=r"rotations must be \(24, 4\)"):
        Pose(np.zeros((22, 4)), np.zeros(3))
