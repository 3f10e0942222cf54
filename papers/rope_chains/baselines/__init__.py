"""Baselines of rope chains, which the paper compares them with: nets, recurrent networks, standard skinning."""

from papers.rope_chains.baselines.baseline import Baseline as Baseline
from papers.rope_chains.baselines.gru import ChainGrus as ChainGrus
from papers.rope_chains.baselines.mass_spring import MassSpringNet as MassSpringNet
from papers.rope_chains.baselines.skins import BoneSkin as BoneSkin

__all__ = ["Baseline", "BoneSkin", "ChainGrus", "MassSpringNet"]
