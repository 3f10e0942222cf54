"""Garments made on unknown bodies, put on ours."""

from .fitness import Fitness as Fitness
from .fitness import fitness as fitness
from .try_on import TryOn as TryOn
from .try_on import try_on as try_on

__all__ = ["Fitness", "TryOn", "fitness", "try_on"]
