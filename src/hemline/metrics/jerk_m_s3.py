"""Flicker: the third derivative of positions in time."""

import numpy as np

from hemline.arrays import FramesOfVertices
from hemline.errors import BadInput


def jerk_m_s3(vertices: FramesOfVertices, fps: float, truth: FramesOfVertices | None = None) -> dict[str, float | None]:
    r"""Mean size of the jerk of all vertices, and its ratio to the truth's.

    $$j^n = (x^{n+3} - 3 x^{n+2} + 3 x^{n+1} - x^n) \, \mathrm{fps}^3$$

    Args:
        vertices: At least four frames [m].
        fps: Frames a second.
        truth: The same frames of the simulation [m].

    Returns:
        `mean` and `truth` [m/s^3]; `ratio`, above 1 where we flicker more. The last two are None without a truth.

    Raises:
        BadInput: Fewer than four frames.
    """
    mean = _mean(vertices, fps)
    if truth is None:
        return {"mean": mean, "truth": None, "ratio": None}
    reference = _mean(truth, fps)
    return {"mean": mean, "truth": reference, "ratio": mean / reference if reference > 0 else None}


def _mean(vertices: np.ndarray, fps: float) -> float:
    if len(vertices) < 4:
        raise BadInput("jerk needs at least four frames", len(vertices), "measure a longer clip")
    sizes = [
        np.linalg.norm(np.diff(vertices[frame : frame + 4].astype(np.float64), n=3, axis=0)[0], axis=1).mean()
        for frame in range(len(vertices) - 3)
    ]
    return float(np.mean(sizes) * fps**3)
