"""What one network learns from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int

from .collision import Distances


@dataclass(frozen=True)
class Lesson:
    """What one network learns from."""

    stage: str
    """`skinning` or `shape`: the name of the checkpoint."""
    bones: Float[np.ndarray, "frames ins"]
    """Displacements of all bones in the key frame [m], float32."""
    rope_bones: Float[np.ndarray, "frames ins"] | None
    """The same, from simulated ropes."""
    free: Float[np.ndarray, " ins"]
    """1 where an input belongs to a simulated bone, 0 for those that the body carries: noise goes on the first."""
    coefficients: Float[np.ndarray, "frames modes"]
    """What should come out [m]."""
    deviations: Float[np.ndarray, " modes"]
    """Root mean square of each coefficient [m]."""
    train: Int[np.ndarray, " train"]
    """Frames to learn from."""
    val: Int[np.ndarray, " val"]
    """Frames that choose the moment to stop."""
    vertex_count: int


@dataclass(frozen=True)
class Contact:
    """What the collision term needs to see of the frames."""

    basis: Float[np.ndarray, "modes rows"]
    """Basis vectors as they are played."""
    before: Callable[[np.ndarray, np.ndarray], np.ndarray]
    """Positions in the key frame (frames, rows) without this network, at some frames and rows [m]."""
    truth: Callable[[np.ndarray, np.ndarray], np.ndarray]
    """True positions in the key frame at some frames and rows [m]."""
    distances: Distances
