"""Garment and body, frame by frame, as files that other programs read: one format, one file."""

from .clip import Clip as Clip
from .clip import Part as Part
from .clip import Skeleton as Skeleton
from .clip import Skin as Skin
from .skin import BONES as BONES
from .skin import check_bones as check_bones
from .skin import skinned as skinned
from .write import FORMATS as FORMATS
from .write import check_format as check_format
from .write import write as write

__all__ = ["BONES", "FORMATS", "Clip", "Part", "Skeleton", "Skin", "check_bones", "check_format", "skinned", "write"]
