"""The State of a close-fitting garment."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Vertices


@dataclass(frozen=True, eq=False)
class AgentDressState:
    """The pose that the garment follows, and everything that depends only on the body shape."""

    rest: Vertices
    """The skinned part of the garment, in the rest pose, without pose and shape offsets [m]."""
    effects: Float[np.ndarray, "shape_regions shape_poses shape_modes"]
    """Effect of the body shape in each pose in which other shapes were draped, per region, followed by the effect of
    the material if it is not that of the fit."""
    axes: Float[np.ndarray, "counting 9"] | None = None
    """Axes of the joint frames, following the pose; None before the first step."""
    distances: Float[np.ndarray, "regions poses"] | None = None
    """Squared distances from these axes to each pose of the model."""
