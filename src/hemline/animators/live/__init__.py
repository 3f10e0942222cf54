"""Plays any garment without a fit: a proxy of it is simulated in real time and carries the garment along."""

from .config import LiveConfig as LiveConfig
from .kind import KIND as KIND
from .model import AnimatorLive as AnimatorLive
from .wearable import Live as Live

__all__ = ["KIND", "AnimatorLive", "Live", "LiveConfig"]
