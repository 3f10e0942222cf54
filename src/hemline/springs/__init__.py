"""Spring bones: chains of bones that game engines and VRM players swing, and the search for their constants."""

from .constants import SpringConstants
from .search import SKIN_EVERY, SpringJudge, Target, tune
from .spring_bones import OUTWARD_LIMIT, CapsuleColliders, SpringChains, distances_to_axes
from .swing import FRAME_SECONDS, Skeleton, swing

__all__ = [
    "FRAME_SECONDS",
    "OUTWARD_LIMIT",
    "SKIN_EVERY",
    "CapsuleColliders",
    "Skeleton",
    "SpringChains",
    "SpringConstants",
    "SpringJudge",
    "Target",
    "distances_to_axes",
    "swing",
    "tune",
]
