"""Makes a model of any garment mesh: tries it on, chooses a method by measurement, fits it, checks it and reports."""

from .make_model import Outcome as Outcome
from .make_model import make_model as make_model
from .report import next_commands as next_commands
from .settings import MakeSettings as MakeSettings
from .trial import Trial as Trial

__all__ = ["MakeSettings", "Outcome", "Trial", "make_model", "next_commands"]
