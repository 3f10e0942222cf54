"""Garment and body, frame by frame, as files that other programs read: one format, one file."""

from .clip import Clip as Clip
from .clip import Part as Part
from .clip import Skeleton as Skeleton
from .write import FORMATS as FORMATS
from .write import check_format as check_format
from .write import write as write

__all__ = ["FORMATS", "Clip", "Part", "Skeleton", "check_format", "write"]
