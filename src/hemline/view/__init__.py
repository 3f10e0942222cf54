"""Garments played live on a page in the browser: what is played, what can be chosen, and the page itself."""

from .page import Page as Page
from .shelf import Choice as Choice
from .shelf import Shelf as Shelf
from .shift import Shift as Shift
from .source import Played as Played
from .source import Simulated as Simulated
from .stage import Stage as Stage

__all__ = ["Choice", "Page", "Played", "Shelf", "Shift", "Simulated", "Stage"]
