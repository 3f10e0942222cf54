"""The offline simulator, whose takes are the ground truth that models are fitted to and compared with."""

from .cloth.join import join_sheets as join_sheets
from .cloth.sheet import Elastic as Elastic
from .cloth.sheet import Sheet as Sheet
from .cloth.sheet import make_sheet as make_sheet
from .cloth.wind import Gusts as Gusts
from .contact.body.surface import BodySurface as BodySurface
from .contact.body.surface import MovingSkin as MovingSkin
from .rest.rest import Rest as Rest
from .rest.sensitivities import Sensitivities as Sensitivities
from .rest.settle import rest_drape as rest_drape
from .rest.settle import settle as settle
from .rest.settle_all import settle_all as settle_all
from .settings import SIMULATOR as SIMULATOR
from .settings import SimSettings as SimSettings
from .step.state import ClothState as ClothState
from .step.state import StepScene as StepScene
from .step.stepper import Stepper as Stepper
from .takes.anchors import Anchor as Anchor
from .takes.anchors import PosedTakes as PosedTakes
from .takes.anchors import produce_anchors as produce_anchors
from .takes.anchors import produce_posed as produce_posed
from .takes.database import Database as Database
from .takes.database import make_database as make_database
from .takes.database import sample_poses as sample_poses
from .takes.produce import ClipRequest as ClipRequest
from .takes.produce import produce as produce
from .takes.rest_states import axis_shapes as axis_shapes
from .takes.rest_states import produce_rests as produce_rests
from .takes.rest_states import random_shapes as random_shapes
from .takes.same_poses import produce_in_poses_of as produce_in_poses_of
from .takes.simulate import simulate as simulate
from .takes.tour import make_tour as make_tour

__all__ = [
    "SIMULATOR",
    "Anchor",
    "BodySurface",
    "ClipRequest",
    "ClothState",
    "Database",
    "Elastic",
    "Gusts",
    "MovingSkin",
    "PosedTakes",
    "Rest",
    "Sensitivities",
    "Sheet",
    "SimSettings",
    "StepScene",
    "Stepper",
    "axis_shapes",
    "join_sheets",
    "make_database",
    "make_sheet",
    "make_tour",
    "produce",
    "produce_anchors",
    "produce_in_poses_of",
    "produce_posed",
    "produce_rests",
    "random_shapes",
    "rest_drape",
    "sample_poses",
    "settle",
    "settle_all",
    "simulate",
]
