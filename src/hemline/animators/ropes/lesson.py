"""What one network learns from."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int

from .collision import Clearances


@dataclass(frozen=True)
class Lesson:
    """Examples for one network: each frame with its true bones and, if asked, once more with those of the ropes."""

    stage: str
    """`skinning` or `shape`: the name of the checkpoint."""
    bones: Float[np.ndarray, "examples ins"]
    """Displacements of all bones in the key frame [m], float32: first the true ones of all frames, then the ropes'."""
    free: Float[np.ndarray, " ins"]
    """1 where an input belongs to a simulated bone, 0 for those that the body carries: noise goes on the first."""
    coefficients: Float[np.ndarray, "examples modes"]
    """What should come out [m]."""
    deviations: Float[np.ndarray, " modes"]
    """Root mean square of each coefficient [m]."""
    train: Int[np.ndarray, " train"]
    """Frames to learn from."""
    val: Int[np.ndarray, " val"]
    """Frames that choose the moment to stop."""
    frame_count: int
    """Number of frames; the example of a frame with the ropes' bones comes this much later."""
    vertex_count: int

    @property
    def roped(self) -> bool:
        """Whether there are examples with the ropes' bones."""
        return len(self.bones) > self.frame_count


@dataclass(frozen=True)
class Contact:
    """What the collision term needs to see of the frames."""

    basis: Float[np.ndarray, "modes rows"]
    """Basis vectors as they are played."""
    astray: Callable[[np.ndarray, np.ndarray], np.ndarray]
    """Displacements without this network, less the true ones, of some examples at some rows [m]."""
    clearances: Clearances
    """Of all frames."""
