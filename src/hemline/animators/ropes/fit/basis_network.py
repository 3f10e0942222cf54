"""A basis with the network of its coefficients."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.arrays import Float
from hemline.learning.mlp import Mlp
from hemline.learning.packed_basis import PackedBasis
from hemline.learning.pca import Pca

from .frames import KeyFrames


@dataclass(frozen=True)
class BasisNetwork:
    """A basis with the network of its coefficients."""

    pca: Pca
    basis: PackedBasis
    network: Mlp
    coefficients: Float[np.ndarray, "frames modes"]
    """Output of the network for the simulated bones of each frame [m]."""

    def rows(self, frames: np.ndarray | slice, rows: np.ndarray | slice) -> Float[np.ndarray, "frames rows"]:
        """Returns the displacements that this network adds, of some frames at some rows [m]."""
        return self.coefficients[frames] @ self.vectors[:, rows]

    @cached_property
    def vectors(self) -> Float[np.ndarray, "modes rows"]:
        """The basis vectors as they are used in playing."""
        return self.basis.unpack()


def project_frames(frames: KeyFrames, before: BasisNetwork | None, pca: Pca) -> Float[np.ndarray, "frames modes"]:
    """Returns the coefficients of the ground truth, less the displacements of `before`, of all frames."""
    whole = pca.coefficients(lambda at: frames.displacements[:, at])
    return whole - before.coefficients @ (before.vectors @ pca.basis.T) if before else whole
