"""The offline simulator: the truth that everything else is fitted to and measured against."""

from .joined import joined as joined
from .produce import Clip as Clip
from .produce import produce as produce
from .rest import Rest as Rest
from .rest_states import produce_rests as produce_rests
from .rest_states import random_shapes as random_shapes
from .rest_states import spread_shapes as spread_shapes
from .sensitivities import Sensitivities as Sensitivities
from .settings import SimSettings as SimSettings
from .settle import rest_drape as rest_drape
from .settle import settle as settle
from .settle_all import settle_all as settle_all
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
    "Rest",
    "Scene",
    "Sensitivities",
    "Sheet",
    "SimSettings",
    "Skin",
    "Stepper",
    "Surface",
    "joined",
    "make_sheet",
    "produce",
    "produce_rests",
    "random_shapes",
    "rest_drape",
    "settle",
    "settle_all",
    "simulate",
    "spread_shapes",
]
