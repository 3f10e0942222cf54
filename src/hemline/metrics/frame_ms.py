"""Milliseconds per frame, by stage."""

from collections.abc import Mapping, Sequence

import numpy as np

from hemline.errors import BadInput


def frame_ms(milliseconds: Sequence[Mapping[str, float]]) -> dict[str, float | dict[str, float]]:
    """Returns median, 95th percentile and worst time of a frame, and the median of each of its stages.

    Args:
        milliseconds: Times of the stages of each frame by name [ms]; their sum is the frame's time.

    Returns:
        `median`, `p95`, `worst` and `stages` [ms]. Medians of stages need not add up to the median of the frame.

    Raises:
        BadInput: There is no frame.

    Example:
        >>> frame_ms([{"skin": 0.25, "ropes": 0.5}, {"skin": 0.25, "ropes": 1.5}])["worst"]
        1.75
    """
    if not milliseconds:
        raise BadInput("no frame was timed", "an empty list", "play at least one frame")
    totals = np.array([sum(frame.values()) for frame in milliseconds])
    names = dict.fromkeys(name for frame in milliseconds for name in frame)
    stages = {name: float(np.median([frame.get(name, 0.0) for frame in milliseconds])) for name in names}
    return {
        "median": float(np.median(totals)),
        "p95": float(np.percentile(totals, 95)),
        "worst": float(totals.max()),
        "stages": stages,
    }
