"""Flicker: the third derivative of positions in time."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import FramesOfVertices
from hemline.errors import BadInput

JERK_FRAMES = 4
"""Consecutive frames that a third difference needs."""


def jerk_m_s3(vertices: FramesOfVertices, fps: float) -> float:
    r"""Returns the mean magnitude of the jerk of all vertices over four consecutive frames.

    $$j^n = (x^{n+3} - 3 x^{n+2} + 3 x^{n+1} - x^n) \, \mathrm{fps}^3$$

    Args:
        vertices: Four frames [m].
        fps: Frames per second.

    Returns:
        The mean [m/s^3]; `jerk_figures` summarises a clip.

    Raises:
        BadInput: There are not exactly four frames.
    """
    if len(vertices) != JERK_FRAMES:
        raise BadInput("jerk needs four frames in a row", len(vertices), "give each frame with the three before it")
    third = np.diff(np.asarray(vertices, np.float64), n=3, axis=0)[0]
    return float(np.linalg.norm(third, axis=1).mean() * fps**3)


def jerk_figures(jerks: Sequence[tuple[float, float]]) -> dict[str, float | None]:
    """Summarises the jerk of a clip, and its ratio to that of the ground truth.

    Args:
        jerks: `jerk_m_s3` of the animator and of the ground truth, at each frame with three frames before it.

    Returns:
        `mean` and `truth` [m/s^3]; `ratio`, above 1 if the animator flickers more, None if the truth does not move.

    Raises:
        BadInput: The list is empty, as for fewer than four frames.
    """
    if not jerks:
        raise BadInput("jerk needs at least four frames", "fewer", "measure a longer clip")
    mean, truth = (float(each) for each in np.mean(jerks, axis=0))
    return {"mean": mean, "truth": truth, "ratio": mean / truth if truth > 0 else None}
