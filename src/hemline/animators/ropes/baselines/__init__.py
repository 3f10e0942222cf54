"""What the paper compares rope chains with. See `README.md`."""

from .baseline import Baseline as Baseline
from .gru import ChainGrus as ChainGrus
from .mass_spring import MassSpringNet as MassSpringNet
from .skins import BoneSkin as BoneSkin

__all__ = ["Baseline", "BoneSkin", "ChainGrus", "MassSpringNet"]
