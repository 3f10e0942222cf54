"""A local web page on which garments are played live: the stage, the catalog of choices, and the page itself."""

from .body_shift import BodyShift as BodyShift
from .catalog import Catalog as Catalog
from .catalog import Choice as Choice
from .page import Page as Page
from .source import PlayedClip as PlayedClip
from .source import SimulatedClip as SimulatedClip
from .stage import Stage as Stage

__all__ = ["BodyShift", "Catalog", "Choice", "Page", "PlayedClip", "SimulatedClip", "Stage"]
