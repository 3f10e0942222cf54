"""Garment and body, frame by frame, as files that other programs read: one format, one file."""

from .character import BoundMesh as BoundMesh
from .character import Capsules as Capsules
from .character import Character as Character
from .character import SpringChains as SpringChains
from .clip import Clip as Clip
from .clip import Part as Part
from .clip import Skeleton as Skeleton
from .clip import Skin as Skin
from .glb.glb_character import OwnMesh as OwnMesh
from .glb.glb_character import write_dressed as write_dressed
from .skin import BONES as BONES
from .skin import check_bones as check_bones
from .skin import skinned as skinned
from .vrm.vrm import check_character_path as check_character_path
from .vrm.vrm import write_vrm as write_vrm
from .write import FORMATS as FORMATS
from .write import check_format as check_format
from .write import write as write

__all__ = [
    "BONES",
    "FORMATS",
    "BoundMesh",
    "Capsules",
    "Character",
    "Clip",
    "OwnMesh",
    "Part",
    "Skeleton",
    "Skin",
    "SpringChains",
    "check_bones",
    "check_character_path",
    "check_format",
    "skinned",
    "write",
    "write_dressed",
    "write_vrm",
]
