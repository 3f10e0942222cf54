"""The estimator as it plays: one frame at a time, without torch."""

from .estimator import EncodedGarment, RuntimeEstimator

__all__ = ["EncodedGarment", "RuntimeEstimator"]
