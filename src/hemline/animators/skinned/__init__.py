"""Plays any garment without a fit: the settled garment is skinned with the body, and nothing else moves it."""

from .config import SkinnedConfig as SkinnedConfig
from .kind import KIND as KIND
from .model import AnimatorSkinned as AnimatorSkinned
from .wearable import Skinned as Skinned

__all__ = ["KIND", "AnimatorSkinned", "Skinned", "SkinnedConfig"]
