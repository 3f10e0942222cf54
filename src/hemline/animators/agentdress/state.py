"""What moves of a close-fitting garment."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Vertices


@dataclass(frozen=True, eq=False)
class AgentDressState:
    """All that moves, and what depends on the shape of the body alone."""

    rest: Vertices
    """The garment in the rest pose, without what pose and shape add [m]."""
    normals: Float[np.ndarray, "verts 3"]
    """Of the body under each vertex, in its rest pose."""
    effects: Float[np.ndarray, "shape_regions told shape_modes"]
    """What the shape adds in each pose in which others than the mean one were settled, by region; then what the
    material does, where it is another one than that of the fit."""
    axes: Float[np.ndarray, "counting 9"] | None = None
    """Of the joints' frames, following the pose; None before the first step."""
    distances: Float[np.ndarray, "regions poses"] | None = None
    """From these to each pose of the model."""
