"""Rope chains as spring bones, which engines swing without hemline."""

from .chains import DEFAULT_CONSTANTS, LEGS, resting_chains, skeleton_of, spring_chains, t_pose
from .weights import chain_weights

__all__ = ["DEFAULT_CONSTANTS", "LEGS", "chain_weights", "resting_chains", "skeleton_of", "spring_chains", "t_pose"]
