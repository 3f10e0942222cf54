"""One basis and its network."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.arrays import Float
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis
from hemline.learning.pca import Pca

from .frames import Frames


@dataclass(frozen=True)
class Stage:
    """One basis and its network."""

    pca: Pca
    basis: PackedBasis
    network: Mlp
    coefficients: Float[np.ndarray, "frames modes"]
    """What the network makes of the simulated bones of each frame [m]."""

    def rows(self, frames: np.ndarray | slice, rows: np.ndarray | slice) -> Float[np.ndarray, "frames rows"]:
        """Displacements that this stage adds, of some frames at some rows [m]."""
        return self.coefficients[frames] @ self.unpacked[:, rows]

    @cached_property
    def unpacked(self) -> Float[np.ndarray, "modes rows"]:
        """The basis as it is played."""
        return self.basis.unpacked()


def projected(frames: Frames, before: Stage | None, pca: Pca) -> Float[np.ndarray, "frames modes"]:
    """Coefficients of the ground truth (less what is there before) of all frames, held-out ones too."""
    whole = pca.coefficients(lambda at: frames.displacements[:, at])
    return whole - before.coefficients @ (before.unpacked @ pca.basis.T) if before else whole
