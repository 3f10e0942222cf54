"""Export of clips to files of other programs; each format has its own module."""

from .character import BoundMesh as BoundMesh
from .character import DressedCharacter as DressedCharacter
from .clip import Clip as Clip
from .clip import ClipPart as ClipPart
from .clip import ClipSkeleton as ClipSkeleton
from .clip import SkinWeights as SkinWeights
from .glb.glb_character import OwnMesh as OwnMesh
from .glb.glb_character import write_dressed as write_dressed
from .skin import DEFAULT_BONES as DEFAULT_BONES
from .skin import check_bones as check_bones
from .skin import skin_clip as skin_clip
from .spring_table import check_table_path as check_table_path
from .spring_table import write_spring_table as write_spring_table
from .vrm.vrm import check_character_path as check_character_path
from .vrm.vrm import write_vrm as write_vrm
from .write import FORMATS as FORMATS
from .write import check_format as check_format
from .write import write as write

__all__ = [
    "DEFAULT_BONES",
    "FORMATS",
    "BoundMesh",
    "Clip",
    "ClipPart",
    "ClipSkeleton",
    "DressedCharacter",
    "OwnMesh",
    "SkinWeights",
    "check_bones",
    "check_character_path",
    "check_format",
    "check_table_path",
    "skin_clip",
    "write",
    "write_dressed",
    "write_spring_table",
    "write_vrm",
]
