"""Puts garments on a body, and tries on those that were made for unknown bodies."""

from .fitness import Fitness as Fitness
from .fitness import fitness as fitness
from .open_garment import open_garment as open_garment
from .try_on import TryOn as TryOn
from .try_on import try_on as try_on

__all__ = ["Fitness", "TryOn", "fitness", "open_garment", "try_on"]
