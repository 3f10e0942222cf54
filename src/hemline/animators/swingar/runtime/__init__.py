"""The estimator as it plays: one frame at a time, without torch."""

from .estimator import Garment, PlayedEstimator

__all__ = ["Garment", "PlayedEstimator"]
