"""Clips of motion on the 24-joint skeleton, without meshes: reading, resampling, cutting."""

from .clean import longest_clean as longest_clean
from .motion import JOINT_NAMES as JOINT_NAMES
from .motion import PARENTS as PARENTS
from .motion import Motion as Motion
from .motion import Pose as Pose
from .read import open_motion as open_motion
from .read import read as read
from .rigs.gltf_clip import split_name as split_name
from .shipped import load as load
from .shipped import names as names
from .store import write as write
from .subjects import subject_of as subject_of
from .varied import varied_clips as varied_clips
from .varied import varied_poses as varied_poses

__all__ = [
    "JOINT_NAMES",
    "PARENTS",
    "Motion",
    "Pose",
    "load",
    "longest_clean",
    "names",
    "open_motion",
    "read",
    "split_name",
    "subject_of",
    "varied_clips",
    "varied_poses",
    "write",
]
