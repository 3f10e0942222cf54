"""The skinning and the shape network as the paper has them: principal components of the frames, random start, no noise.

What hemline fits instead is in `animators/ropes/fit/networks`: components of a linear map, a start as that map, noise.
"""

from dataclasses import dataclass

import numpy as np
import torch

from hemline.arrays import Float, Int
from hemline.learning.collision import Clearances
from hemline.learning.fit.network import ScaledNetwork
from hemline.learning.fit.trainer import Schedule, Trainer
from hemline.learning.pca import deviations_of, principal_of_rows

COMPONENTS, HIDDEN, BATCH = 100, 500, 128
PCA_FRAMES = 2500
"""Number of frames whose principal components are the basis."""
DATA_WEIGHT, COLLISION_WEIGHT = 0.1, 1000.0
"""Weights of the data term and of the collision term in the paper."""
EXPANSION = 0.005
"""Distance that the collision term keeps between cloth and body [m]; the paper says "a small amount"."""
COLLISION_VERTICES = 256
"""Number of vertices sampled for the collision term in each step."""


@dataclass(frozen=True)
class Frames:
    """Bones and vertices of many frames in the frame of the key joint, as displacements from rest [m]."""

    bones: Float[np.ndarray, "frames ins"]
    vertices: Float[np.ndarray, "frames rows"]
    side: Int[np.ndarray, " frames"]
    """0: to train on, 1: chooses the pass, 2: judges."""
    clearances: Clearances | None = None
    """The body around each vertex, for the collision term and for the share of vertices inside."""

    def of(self, side: int) -> Int[np.ndarray, " some"]:
        """Returns the frames of a side."""
        return np.flatnonzero(self.side == side)


@dataclass(frozen=True)
class Training:
    """How both networks are trained; the defaults are the paper's, but for the number of passes, which it lacks."""

    epochs: int = 200
    rates: tuple[float, float] = (1e-4, 1e-5)
    """Learning rates of Adam at the start, of the skinning and of the shape network. A cosine takes them to zero."""
    collision: bool = False
    """Whether the loss has the collision term."""
    overtrained: bool = False
    """Whether the error on the frames to train on chooses the pass, instead of that on validation data."""


def collision_distances(offsets: torch.Tensor, normals: torch.Tensor, heights: torch.Tensor) -> torch.Tensor:
    r"""Returns how far each vertex is from where it is clear of the body, along the line to its ground truth [m].

    Where a vertex is nearer to the body than `EXPANSION`, that place is the first on the line that is not; or the
    ground truth, if that is as near. The place is held fixed, so that the gradient is parallel to that of the data
    term. Elsewhere it is 0.

    Args:
        offsets: Vertices less their ground truth, (..., 3) [m].
        normals: Normals of the body, (..., 3).
        heights: Heights of the ground truth above the body [m]; infinite where there is no term.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 (push out along r). Differs: half-spaces of the mesh instead of the primitives.
    """
    with torch.no_grad():
        outwards = (offsets * normals).sum(dim=-1)
        missing = EXPANSION - heights - outwards
        share = torch.where(missing > 0, (missing / (-outwards).clamp(min=1e-9)).clamp(0, 1), torch.zeros_like(missing))
        share = torch.where((missing > 0) & (outwards >= 0), torch.ones_like(share), share)
        places = offsets * (1 - share)[..., None]
    return torch.linalg.vector_norm(offsets - places, dim=-1)


class PrintedLoss:
    """The loss of one network: mean square distance of the vertices, and the collision term."""

    name = "network"

    def __init__(self, frames: Frames, left: Float[np.ndarray, "frames rows"], training: Training, seed: int):
        self.frames, self.training = frames, training
        self.samples, val = frames.of(0), frames.of(1)
        self.val = self.samples if training.overtrained or not len(val) else val
        some = self.samples[np.linspace(0, len(self.samples) - 1, min(PCA_FRAMES, len(self.samples))).astype(int)]
        self.basis = principal_of_rows(left[some].astype(np.float64), COMPONENTS)[0].astype(np.float32)
        self.left = left
        coefficients = left @ self.basis.T
        self.bones, self.coefficients = torch.from_numpy(frames.bones), torch.from_numpy(coefficients)
        scale = np.maximum(deviations_of(coefficients[self.samples]), 1e-6).astype(np.float32)
        self.network = ScaledNetwork(frames.bones[self.samples], scale, hidden=HIDDEN, seed=seed)
        self.network.start_at_zero()

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Parameters of the network."""
        return self.network.parameters

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the loss on some frames."""
        some = chosen[mine]
        made = self.network(self.bones[some])
        total = DATA_WEIGHT * ((made - self.coefficients[some]) ** 2).sum(dim=1).mean() * (3 / self.left.shape[1])
        if self.training.collision:
            total = total + COLLISION_WEIGHT * self._collision(some, made, random)
        return total

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the loss on the frames that choose the pass."""
        return self.loss(self.val, random, slice(None))

    def _collision(self, some: np.ndarray, made: torch.Tensor, random: np.random.Generator) -> torch.Tensor:
        """Returns the mean square of `collision_distances` over random vertices [m^2]."""
        clearances = self.frames.clearances
        assert clearances is not None
        count = self.left.shape[1] // 3
        vertices = random.choice(count, min(COLLISION_VERTICES, count), replace=False)
        rows = (3 * vertices[:, None] + np.arange(3)).ravel()
        offsets = made @ torch.from_numpy(self.basis[:, rows]) - torch.from_numpy(self.left[some[:, None], rows])
        normals, heights = (torch.from_numpy(each) for each in clearances.rows(some, vertices))
        distances = collision_distances(offsets.reshape(len(some), -1, 3), normals, heights)
        return (distances**2).mean()

    def remaining(self) -> Float[np.ndarray, "frames rows"]:
        """Returns what the network leaves of the displacements [m]."""
        with torch.no_grad():
            made = self.network(self.bones).numpy()
        return self.left - made @ self.basis


def train(
    frames: Frames, left: Float[np.ndarray, "frames rows"], training: Training, network: int, seed: int
) -> np.ndarray:
    """Trains one network to what is left of the displacements, and returns what its prediction leaves [m].

    Args:
        frames: Bones and sides.
        left: What is to be predicted [m].
        training: Options.
        network: 0 for the skinning network, 1 for the shape network.
        seed: Seed of the weights and of the order of frames.
    """
    objective = PrintedLoss(frames, left, training, seed)
    trainer = Trainer(objective, Schedule(training.epochs, BATCH, training.rates[network], seed, 1))
    trainer.run(progress=lambda done, total: None)
    return objective.remaining()


def train_both(frames: Frames, training: Training) -> tuple[np.ndarray, np.ndarray]:
    """Trains the skinning network, then the shape network; returns what the first and what both leave [m]."""
    first = train(frames, frames.vertices, training, 0, 0)
    return first, train(frames, first, training, 1, 1)


def error_mm(left: Float[np.ndarray, "frames rows"]) -> float:
    """Returns the mean distance of vertices [mm]."""
    return 1e3 * float(np.linalg.norm(left.reshape(len(left), -1, 3), axis=2).mean())


def inside_percent(frames: Frames, left: Float[np.ndarray, "some rows"], some: Int[np.ndarray, " some"]) -> float:
    """Returns the share of the vertices that a prediction puts inside the body [percent].

    Args:
        frames: With the body around each vertex.
        left: What the prediction leaves of the displacements in these frames [m].
        some: Indices of the frames.
    """
    assert frames.clearances is not None
    normals = frames.clearances.normals[some].astype(np.float32)
    heights = frames.clearances.heights[some].astype(np.float32)
    return 100 * float((heights - (left.reshape(len(some), -1, 3) * normals).sum(axis=2) < 0).mean())
