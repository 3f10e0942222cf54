"""Any garment at once: a coarse copy of it simulated in real time, the fine mesh carried along."""

from .config import LiveConfig as LiveConfig
from .kind import KIND as KIND
from .model import AnimatorLive as AnimatorLive
from .wearable import Live as Live

__all__ = ["KIND", "AnimatorLive", "Live", "LiveConfig"]
