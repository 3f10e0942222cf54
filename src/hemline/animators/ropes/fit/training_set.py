"""Training sets of the networks of rope chains."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.learning.collision import Clearances
from hemline.learning.mlp import Mlp


@dataclass(frozen=True)
class TrainingSet:
    """Inputs, outputs and the split of one network."""

    stage: str
    """`skinning` or `shape`; also the name of the checkpoint."""
    bones: Float[np.ndarray, "frames ins"]
    """Displacements of all bones in the key frame [m], float32."""
    free: Float[np.ndarray, " ins"]
    """1 where an input belongs to a simulated bone, which gets noise, 0 for bones that the body carries."""
    coefficients: Float[np.ndarray, "frames modes"]
    """The target outputs [m]."""
    deviations: Float[np.ndarray, " modes"]
    """Root mean square of each coefficient [m]."""
    train: Int[np.ndarray, " train"]
    """Frames to train on."""
    val: Int[np.ndarray, " val"]
    """Frames that choose the best epoch."""
    vertex_count: int


@dataclass(frozen=True)
class CollisionTerm:
    """Data of the frames for the collision term."""

    basis: Float[np.ndarray, "modes rows"]
    """Basis vectors as they are used in playing."""
    displacements: Float[np.ndarray, "frames rows"]
    """The ground truth [m]."""
    before: tuple[Float[np.ndarray, "frames modes"], Float[np.ndarray, "modes rows"]] | None
    """Coefficients and basis of the network before this one, whose displacements are added."""
    clearances: Clearances
    """Clearances of all frames."""


@dataclass(frozen=True)
class MeshNetworks:
    """The two networks from bones to mesh, as they are used in playing."""

    networks: tuple[Mlp, Mlp]
    basis: Float[np.ndarray, "modes rows"]
    """Both bases, one below the other."""

    def rows(self, bones: Float[np.ndarray, "frames ins"]) -> Float[np.ndarray, "frames rows"]:
        """Returns displacements of the vertices for given bones [m]."""
        return np.concatenate([network.many(bones) for network in self.networks], axis=1) @ self.basis
