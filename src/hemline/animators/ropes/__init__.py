"""Rope chains: a few ropes are simulated, two small networks turn their bones into the garment. See `README.md`."""

from .chains import Ropes as Ropes
from .config import RopesConfig as RopesConfig
from .kind import KIND as KIND
from .model import AnimatorRopes as AnimatorRopes
from .model import AnimatorRopesState as AnimatorRopesState

__all__ = ["KIND", "AnimatorRopes", "AnimatorRopesState", "Ropes", "RopesConfig"]
