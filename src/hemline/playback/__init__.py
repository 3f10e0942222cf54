"""From a fitted animator to frames: play, record, evaluate."""

from .evaluate import Evaluation as Evaluation
from .evaluate import evaluate as evaluate
from .play import Frame as Frame
from .play import play as play
from .record import record as record

__all__ = ["Evaluation", "Frame", "evaluate", "play", "record"]
