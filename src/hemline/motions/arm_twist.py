"""Takes out of straight arms the twist that a recording cannot know.

The twist of an upper arm about its own bone is seen by the plane in which the elbow bends. Of a straight arm it is
guessed, and many recordings turn it by half a turn within some frames while the hand stays where it is. Cloth on that
arm, a sleeve, would be wrung.
"""

from dataclasses import replace

import numpy as np

from hemline.arrays import Bool, Float

from .motion import JOINT_NAMES, Motion
from .quaternions import angle, from_axis_angle, inverse, multiply

STRAIGHT_DEG = 30.0
"""An elbow that bends by less than this leaves the twist of its upper arm unknown [deg]."""
MOST_DEG = 110.0
"""Largest twist of an upper arm, from the T-pose, that is believed of a straight arm [deg]."""
MOST_DEG_S = 1200.0
"""Fastest twist of an upper arm that is believed of a straight arm [deg/s]."""
MARGIN_S = 0.1
"""Frames this near to one with a wrong twist are not believed either, while the arm is straight [s]."""
POSES_DEG = 45.0
"""Poses that are farther apart than this in most frames, by the joint that turns most, are no movement [deg]."""
SIDES = ("left", "right")


def steady_arm_twist(motion: Motion) -> Motion:
    """Returns a motion whose straight arms are twisted no farther and no faster than arms can be.

    Upper arm and forearm turn back about their bones, and the hand turns against them, so that all joints stay where
    they are, and the hands keep their orientation. Between frames that are believed the twist is interpolated.

    Args:
        motion: The motion.

    Returns:
        The motion; the same object if nothing had to be changed, or if its frames are unrelated poses.
    """
    rotations, changed = motion.rotations.astype(np.float64), False
    if not _is_movement(rotations):
        return motion
    for side in SIDES:
        shoulder, elbow, wrist = (JOINT_NAMES.index(f"{side}_{name}") for name in ("shoulder", "elbow", "wrist"))
        twist, bend = _twists(rotations[:, shoulder]), _bends(rotations[:, elbow])
        wrong = _wrong_frames(twist, bend < np.deg2rad(STRAIGHT_DEG), motion.fps)
        if not wrong.any():
            continue
        changed, turn = True, _interpolate(twist, wrong) - twist
        about, against = _about_bone(turn), _about_bone(-turn)
        rotations[wrong, shoulder] = multiply(rotations[wrong, shoulder], about[wrong])
        rotations[wrong, elbow] = multiply(against[wrong], multiply(rotations[wrong, elbow], about[wrong]))
        rotations[wrong, wrist] = multiply(against[wrong], rotations[wrong, wrist])
    return replace(motion, rotations=rotations.astype(np.float32)) if changed else motion


def _is_movement(rotations: Float[np.ndarray, "frames joints 4"]) -> bool:
    """Returns whether each frame follows from the one before, so that what lies between two can be interpolated."""
    turns = angle(multiply(inverse(rotations[:-1]), rotations[1:]))
    return len(rotations) < 2 or bool(np.median(np.max(turns, axis=1)) <= np.deg2rad(POSES_DEG))


def _twists(rotations: Float[np.ndarray, "frames 4"]) -> Float[np.ndarray, " frames"]:
    """Returns the twists about x, the bone of an arm in the T-pose, from -pi to pi [rad]."""
    twice = 2 * np.arctan2(rotations[:, 1], rotations[:, 0])
    return (twice + np.pi) % (2 * np.pi) - np.pi


def _bends(rotations: Float[np.ndarray, "frames 4"]) -> Float[np.ndarray, " frames"]:
    """Returns the angles between x before and after rotations [rad]."""
    return 2 * np.arctan2(np.hypot(rotations[:, 2], rotations[:, 3]), np.hypot(rotations[:, 0], rotations[:, 1]))


def _wrong_frames(
    twist: Float[np.ndarray, " frames"], straight: Bool[np.ndarray, " frames"], fps: float
) -> Bool[np.ndarray, " frames"]:
    """Returns the frames of straight arms whose twist is not believed, and those next to them."""
    step = np.abs((np.diff(twist) + np.pi) % (2 * np.pi) - np.pi)
    fast = np.concatenate([[False], step * fps > np.deg2rad(MOST_DEG_S)])
    fast[:-1] |= fast[1:]
    wrong = straight & ((np.abs(twist) > np.deg2rad(MOST_DEG)) | fast)
    margin = round(MARGIN_S * fps)
    near = np.convolve(wrong, np.ones(2 * margin + 1))[margin : margin + len(wrong)] > 0.5
    return straight & near


def _interpolate(
    twist: Float[np.ndarray, " frames"], wrong: Bool[np.ndarray, " frames"]
) -> Float[np.ndarray, " frames"]:
    """Returns the twists, interpolated over wrong frames; before the first right frame and after the last one they
    stay, and where no frame is right they are zero."""
    if wrong.all():
        return np.zeros_like(twist)
    right = np.flatnonzero(~wrong)
    return np.interp(np.arange(len(twist)), right, twist[right])


def _about_bone(angles: Float[np.ndarray, " frames"]) -> Float[np.ndarray, "frames 4"]:
    """Returns the rotations by angles about x."""
    return from_axis_angle(angles[:, None] * np.array([1.0, 0.0, 0.0]))
