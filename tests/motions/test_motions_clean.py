from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import motions
from hemline.motions import JOINT_NAMES, Motion
from hemline.motions.clean import jump


def still(frames=100, fps=120.0):
    rotations = np.zeros((frames, 24, 4))
    rotations[..., 0] = 1
    return Motion(rotations, np.zeros((frames, 3)), fps, 0.8)


def turned(motion, joint, frame, degrees):
    """The same, with a joint turned from a frame on."""
    rotations = motion.rotations.copy()
    quaternion = Rotation.from_euler("x", degrees, degrees=True).as_quat()[[3, 0, 1, 2]]
    rotations[frame:, JOINT_NAMES.index(joint)] = quaternion
    return replace(motion, rotations=rotations)


def test_a_clip_without_jumps_is_clean_from_end_to_end():
    assert motions.longest_clean(still()) == (0, 100)
    assert motions.longest_clean(still(frames=1)) == (0, 1)


@pytest.mark.parametrize(("degrees", "clean"), [(24, (0, 100)), (26, (30, 100))])
def test_a_jump_is_3000_degrees_a_second(degrees, clean):
    assert motions.longest_clean(turned(still(), "left_knee", 30, degrees)) == clean


@pytest.mark.parametrize(("degrees", "clean"), [(12, (0, 100)), (13, (30, 100))])
def test_a_pelvis_does_not_turn_faster_than_1500_degrees_a_second(degrees, clean):
    motion = turned(still(), "pelvis", 30, degrees)
    assert motions.longest_clean(motion) == clean
    said = "" if clean[0] == 0 else "the pelvis turns at 1560 deg/s"
    assert jump(motion[29], motion[30], 1 / 120) == said


@pytest.mark.parametrize(("speed", "clean"), [(19.0, (0, 100)), (21.0, (30, 100))])
def test_a_pelvis_does_not_move_faster_than_20_metres_a_second(speed, clean):
    motion = still()
    translations = motion.translations.copy()
    translations[30:, 0] = speed / motion.fps
    assert motions.longest_clean(replace(motion, translations=translations)) == clean


def test_what_jumps_from_pose_to_pose_is_said():
    knee = turned(still(), "left_knee", 30, 26)
    assert jump(knee[29], knee[30], 1 / 120) == "the left_knee turns at 3120 deg/s"
    assert jump(knee[29], knee[30], 1 / 60) == ""
    away = replace(knee[30], translation=np.float32([0.0, 0.3, 0.4]))
    assert jump(knee[29], away, 0.01) == "the pelvis moves at 50 m/s"


def test_the_longest_of_several_stretches_is_found():
    motion = turned(turned(still(), "right_elbow", 20, 40), "pelvis", 85, 90)
    assert motions.longest_clean(motion) == (20, 85)


@pytest.mark.parametrize("joint", ["left_wrist", "right_foot", "head"])
def test_hands_toes_and_head_are_not_judged(joint):
    assert motions.longest_clean(turned(still(), joint, 30, 90)) == (0, 100)


def test_a_collar_that_jumps_takes_the_arm_along():
    assert motions.longest_clean(turned(still(), "left_collar", 30, 40)) == (30, 100)
    rotations = turned(still(), "left_collar", 30, 40).rotations.copy()
    rotations[30:, JOINT_NAMES.index("left_shoulder")] = rotations[30, JOINT_NAMES.index("left_collar")] * [
        1,
        -1,
        -1,
        -1,
    ]
    assert motions.longest_clean(replace(still(), rotations=rotations)) == (0, 100), "the arm stays where it was"
