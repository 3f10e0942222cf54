"""Summary of one number per frame over a clip."""

from collections.abc import Sequence

import numpy as np


def mean_and_worst(values: Sequence[float]) -> dict[str, float]:
    """Returns the mean over the frames, and the value farthest from 0, with its sign.

    Args:
        values: One value per frame, in any unit.

    Returns:
        `mean` and `worst_frame`, in that unit.

    Example:
        >>> mean_and_worst([1.0, -4.0, 0.0])
        {'mean': -1.0, 'worst_frame': -4.0}
    """
    every = np.asarray(values, np.float64)
    return {"mean": float(every.mean()), "worst_frame": float(every[np.argmax(np.abs(every))])}
