"""Poses the joints of a clip in the axes of its file."""

import numpy as np

from hemline.motions.bvh import Bvh
from hemline.motions.quaternions import Quaternion, Vector, multiply, rotate


def pose_joints(bvh: Bvh, moving: tuple[int, ...]) -> tuple[Quaternion, Vector]:
    """Returns the global rotation and the position of each joint in each frame.

    Args:
        bvh: The clip.
        moving: Joints whose position channels are used; all others keep their offsets.
    """
    rotations = bvh.rotations.copy()
    positions = np.empty((*rotations.shape[:2], 3))
    for joint, parent in enumerate(bvh.skeleton.parents):
        place = bvh.positions[joint] if joint in moving and joint in bvh.positions else bvh.skeleton.offsets[joint]
        if parent < 0:
            positions[:, joint] = place
        else:
            rotations[:, joint] = multiply(rotations[:, parent], rotations[:, joint])
            positions[:, joint] = positions[:, parent] + rotate(rotations[:, parent], place)
    return rotations, positions
