"""Playback of fitted animators: play, record and evaluate, for one body or a crowd."""

from .character import character as character
from .crowd import crowd as crowd
from .detail import detail_for as detail_for
from .detail import level_of as level_of
from .detail import pixels_of as pixels_of
from .evaluate import Evaluation as Evaluation
from .evaluate import evaluate as evaluate
from .play import play as play
from .player.frame import Frame as Frame
from .player.own_mesh import own_mesh as own_mesh
from .player.player import Player as Player
from .player.player import PlayerState as PlayerState
from .record import record as record
from .redress import redress_take as redress_take

__all__ = [
    "Evaluation",
    "Frame",
    "Player",
    "PlayerState",
    "character",
    "crowd",
    "detail_for",
    "evaluate",
    "level_of",
    "own_mesh",
    "pixels_of",
    "play",
    "record",
    "redress_take",
]
