"""Garments made on unknown bodies, put on ours."""

from .fitness import Fitness as Fitness
from .fitness import fitness as fitness
from .open_worn import open_worn as open_worn
from .try_on import TryOn as TryOn
from .try_on import try_on as try_on

__all__ = ["Fitness", "TryOn", "fitness", "open_worn", "try_on"]
