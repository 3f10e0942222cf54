"""Clips of motion on the 24-joint skeleton: read, resample, cut; never a mesh."""

from .motion import JOINT_NAMES as JOINT_NAMES
from .motion import PARENTS as PARENTS
from .motion import Motion as Motion
from .motion import Pose as Pose

__all__ = ["JOINT_NAMES", "PARENTS", "Motion", "Pose"]
