"""The interface of signed distances that collision handling uses: exact, neural, or a sphere in a test."""

from typing import Protocol, runtime_checkable

import numpy as np

from hemline.arrays import Float, Points


@runtime_checkable
class Distance(Protocol):
    """A signed distance to one body in one pose, negative inside."""

    def signed_distances(self, points: Points) -> Float[np.ndarray, " points"]:
        """Returns the signed distances of points [m]."""
        ...

    def with_gradients(self, points: Points) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
        """Returns the signed distances of points [m] and their gradients, which need not have length one."""
        ...
