"""Flicker: the third derivative of positions in time."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import FramesOfVertices
from hemline.errors import BadInput

JERK_FRAMES = 4
"""Frames in a row that a third difference takes."""


def jerk_m_s3(vertices: FramesOfVertices, fps: float) -> float:
    r"""Mean size of the jerk of all vertices over four frames in a row.

    $$j^n = (x^{n+3} - 3 x^{n+2} + 3 x^{n+1} - x^n) \, \mathrm{fps}^3$$

    Args:
        vertices: Four frames [m].
        fps: Frames a second.

    Returns:
        The mean [m/s^3]; `jerk_figures` sums up a clip.

    Raises:
        BadInput: Other than four frames.
    """
    if len(vertices) != JERK_FRAMES:
        raise BadInput("jerk needs four frames in a row", len(vertices), "give each frame with the three before it")
    third = np.diff(np.asarray(vertices, np.float64), n=3, axis=0)[0]
    return float(np.linalg.norm(third, axis=1).mean() * fps**3)


def jerk_figures(jerks: Sequence[tuple[float, float]]) -> dict[str, float | None]:
    """The jerk of a clip, and its ratio to the truth's.

    Args:
        jerks: `jerk_m_s3` of the animator and of the truth, at each frame that has three before it.

    Returns:
        `mean` and `truth` [m/s^3]; `ratio`, above 1 where we flicker more, None where the truth does not move.

    Raises:
        BadInput: None: fewer than four frames.
    """
    if not jerks:
        raise BadInput("jerk needs at least four frames", "fewer", "measure a longer clip")
    mean, truth = (float(each) for each in np.mean(jerks, axis=0))
    return {"mean": mean, "truth": truth, "ratio": mean / truth if truth > 0 else None}
