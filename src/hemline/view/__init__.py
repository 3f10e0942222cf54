"""Garments played live on a page in the browser: what is played, what can be chosen, and the page itself."""

from .page import Page as Page
from .catalog import Choice as Choice
from .catalog import Catalog as Catalog
from .body_shift import BodyShift as BodyShift
from .source import PlayedClip as PlayedClip
from .source import SimulatedClip as SimulatedClip
from .stage import Stage as Stage

__all__ = ["Choice", "Page", "PlayedClip", "Catalog", "BodyShift", "SimulatedClip", "Stage"]
