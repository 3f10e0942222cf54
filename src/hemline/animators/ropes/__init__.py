"""Rope chains: a few ropes are simulated, two small networks turn their bones into the garment. See `README.md`."""

from .animator_state import AnimatorRopesState as AnimatorRopesState
from .bones.chains import Ropes as Ropes
from .config import RopesConfig as RopesConfig
from .kind import KIND as KIND
from .model import AnimatorRopes as AnimatorRopes

__all__ = ["KIND", "AnimatorRopes", "AnimatorRopesState", "Ropes", "RopesConfig"]
