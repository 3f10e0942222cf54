"""A local web page on which garments are played live: the stage, the catalog of choices, and the page itself."""

from .browser.page import Page as Page
from .stage.body_shift import BodyShift as BodyShift
from .stage.catalog import Catalog as Catalog
from .stage.catalog import Choice as Choice
from .stage.source import PlayedClip as PlayedClip
from .stage.source import SimulatedClip as SimulatedClip
from .stage.stage import Stage as Stage

__all__ = ["BodyShift", "Catalog", "Choice", "Page", "PlayedClip", "SimulatedClip", "Stage"]
