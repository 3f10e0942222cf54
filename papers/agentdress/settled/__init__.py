"""Settled garments that the experiments measure against, and the residual forces on them."""
