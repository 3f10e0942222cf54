"""The offline simulator: the truth that everything else is fitted to and measured against."""

from .joined import joined as joined
from .produce import Clip as Clip
from .produce import produce as produce
from .rest import rest_drape as rest_drape
from .settings import SimSettings as SimSettings
from .sheet import Elastic as Elastic
from .sheet import Sheet as Sheet
from .sheet import make_sheet as make_sheet
from .simulate import simulate as simulate
from .state import ClothState as ClothState
from .state import Scene as Scene
from .stepper import Stepper as Stepper
from .surface import Skin as Skin
from .surface import Surface as Surface
from .wind import Gusts as Gusts

__all__ = [
    "Clip",
    "ClothState",
    "Elastic",
    "Gusts",
    "Scene",
    "Sheet",
    "SimSettings",
    "Skin",
    "Stepper",
    "Surface",
    "joined",
    "make_sheet",
    "produce",
    "rest_drape",
    "simulate",
]  # fmt: skip
