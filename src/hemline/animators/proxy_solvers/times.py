"""Times that all solvers share."""

FRAME_SECONDS = 1 / 30
"""Length of a frame; a longer time is cut into frames of this length at most [s]."""
