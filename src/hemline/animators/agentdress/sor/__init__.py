"""Sensitivity-optimised rigging (SOR), the pose model of the paper."""
