"""The named tuple that the kernel of features takes."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Float


class TrailArrays(NamedTuple):
    """The arrays of a `trail.Trail`, float32, as kernels take them."""

    skinned: Float[np.ndarray, "verts 3"]
    """Positions by skinning [m]."""
    turns: Float[np.ndarray, "verts 4"]
    """Rotation of each vertex by skinning, wxyz."""
    carried: Float[np.ndarray, "verts 3"]
    """Positions if carried rigidly with the key joint [m]."""
    trails: Float[np.ndarray, "verts filters 3"]
    """Filters of `skinned`, see `feature_kernels.remember` [m], [m/s]."""
    carried_trails: Float[np.ndarray, "verts filters 3"]
    """Filters of `carried`."""
