"""Poses that tests of the simulator share."""

import numpy as np

from hemline.motions import JOINT_NAMES, PARENTS, Motion
from hemline.motions.quaternions import from_axis_angle, inverse, multiply


def kick_motion(shaped, frames, *, knee_deg=150.0, hip_deg=-80.0):
    """The left leg of a body at rest, thigh up and heel to the seat in the middle of so many frames, and back."""
    rest = shaped.rest_pose
    before, share = rest.rotations.astype(np.float64), np.sin(np.pi * np.arange(frames) / (frames - 1)) ** 2
    rotations = np.repeat(before[None], frames, axis=0)
    for name, degrees in (("left_hip", hip_deg), ("left_knee", knee_deg)):
        joint = parent = JOINT_NAMES.index(name)
        above = np.array([1.0, 0, 0, 0])
        while (parent := PARENTS[parent]) >= 0:
            above = multiply(before[parent], above)
        turns = from_axis_angle(np.deg2rad(degrees) * share[:, None] * [1.0, 0, 0])
        rotations[:, joint] = multiply(multiply(multiply(inverse(above), turns), above), before[joint])
    translations = np.repeat(rest.translation[None], frames, axis=0)
    return Motion(rotations.astype(np.float32), translations.astype(np.float32), 30.0, shaped.leg_length)
