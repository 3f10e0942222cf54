"""Spring bones: chains of bones that game engines and VRM players swing, and the search for their constants."""

from .constants import SpringConstants as SpringConstants
from .search import SKIN_EVERY as SKIN_EVERY
from .search import SpringComparison as SpringComparison
from .search import SpringTarget as SpringTarget
from .search import tune as tune
from .spring_bones import OUTWARD_LIMIT as OUTWARD_LIMIT
from .spring_bones import CapsuleColliders as CapsuleColliders
from .spring_bones import SpringChains as SpringChains
from .spring_bones import distances_to_axes as distances_to_axes
from .swing import FRAME_SECONDS as FRAME_SECONDS
from .swing import SkeletonMotion as SkeletonMotion
from .swing import swing as swing

__all__ = [
    "FRAME_SECONDS",
    "OUTWARD_LIMIT",
    "SKIN_EVERY",
    "CapsuleColliders",
    "SkeletonMotion",
    "SpringChains",
    "SpringComparison",
    "SpringConstants",
    "SpringTarget",
    "distances_to_axes",
    "swing",
    "tune",
]
