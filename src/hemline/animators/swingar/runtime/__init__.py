"""The estimator at run time: one frame at a time, without torch."""

from .estimator import EncodedGarment, RuntimeEstimator

__all__ = ["EncodedGarment", "RuntimeEstimator"]
