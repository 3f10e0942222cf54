"""What the networks of rope chains are trained on."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.learning.collision import Clearances
from hemline.learning.mlp import Mlp


@dataclass(frozen=True)
class TrainingSet:
    """Inputs, outputs and the split of one network."""

    stage: str
    """`skinning` or `shape`: the name of the checkpoint."""
    bones: Float[np.ndarray, "frames ins"]
    """Displacements of all bones in the key frame [m], float32."""
    free: Float[np.ndarray, " ins"]
    """1 where an input belongs to a simulated bone, 0 for those that the body carries: noise goes on the first."""
    coefficients: Float[np.ndarray, "frames modes"]
    """The outputs that are wanted [m]."""
    deviations: Float[np.ndarray, " modes"]
    """Root mean square of each coefficient [m]."""
    train: Int[np.ndarray, " train"]
    """Frames to train on."""
    val: Int[np.ndarray, " val"]
    """Frames that choose the best epoch."""
    vertex_count: int


@dataclass(frozen=True)
class Contact:
    """What the collision term needs to see of the frames."""

    basis: Float[np.ndarray, "modes rows"]
    """Basis vectors as they are played."""
    displacements: Float[np.ndarray, "frames rows"]
    """The ground truth [m]."""
    before: tuple[Float[np.ndarray, "frames modes"], Float[np.ndarray, "modes rows"]] | None
    """Coefficients and basis of the network before this one, which add to what it makes."""
    clearances: Clearances
    """Of all frames."""


@dataclass(frozen=True)
class Skinned:
    """The two networks of a garment as they are played."""

    networks: tuple[Mlp, Mlp]
    basis: Float[np.ndarray, "modes rows"]
    """Both bases, one below the other."""

    def rows(self, bones: Float[np.ndarray, "frames ins"]) -> Float[np.ndarray, "frames rows"]:
        """Displacements of the vertices that they make of bones [m]."""
        return np.concatenate([network.many(bones) for network in self.networks], axis=1) @ self.basis
