"""Training of one network with torch: coefficients from bones, by a data term and a collision term."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from hemline.animators.ropes.config import RopesConfig
from hemline.learning.collision import collision_loss
from hemline.learning.fit.batches import sample_vertices, with_noise
from hemline.learning.fit.network import ScaledNetwork
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer
from hemline.learning.mlp import Mlp

from .linear import noise_on_bones
from .training_set import CollisionTerm, TrainingSet

LEAST_GAIN = 0.04
"""Relative fall of the validation loss, a square of errors, from which on a network is kept."""


def train_network(
    training: TrainingSet,
    contact: CollisionTerm | None,
    config: RopesConfig,
    *,
    rate: float,
    seed: int,
    mark: str,
    progress: Callable[[int, int], None],
    folder: Path | None,
) -> Mlp | None:
    r"""Fits a network of two hidden layers, if one is better than a linear map.

    The data term is the mean square distance of the vertices. With an orthonormal basis it equals, up to a constant,
    that of the coefficients, $\sum_k (c_k - c^*_k)^2 / V$, at a hundredth of the cost.

    Args:
        training: Inputs, outputs and the split.
        contact: Data of the collision term; None omits it.
        config: Options.
        rate: First learning rate of Adam; a cosine takes it to zero.
        seed: Seed of the weights, of the order of frames and of the noise.
        mark: Hash of everything that the training depends on; a checkpoint with another one is not used.
        progress: Called with the epochs done and in all.
        folder: Where the checkpoint is saved; None: nowhere.

    Returns:
        The network, with the scales of inputs and outputs folded in. Returns None if no pass lowers the validation loss
        of the linear map by `LEAST_GAIN`.

    Raises:
        BadModel: The loss is no longer finite.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 to 9. Differs: inputs and outputs are scaled to unit deviation; the network begins
        as the ridge regression (`linear_start`), without which a thousand frames leave five times the error on unseen
        clips, and the paper's learning rates hardly improve it; noise on the bones; the epoch with the least validation
        loss is kept.
    """
    objective = CoefficientObjective(training, contact, config, seed)
    schedule = Schedule(config.epochs, config.batch, rate, seed, config.threads)
    checkpoint = (
        Checkpoint(folder / f"{training.stage}.safetensors", mark, config.checkpoint_epochs) if folder else None
    )
    trainer = Trainer(objective, schedule)
    trainer.run(checkpoint=checkpoint, progress=progress)
    if min(trainer.losses) > (1 - LEAST_GAIN) * trainer.losses[0]:
        return None
    return objective.network.to_mlp()


class CoefficientObjective:
    """The loss of one network: the error of its coefficients, and the collision of its vertices with the body."""

    def __init__(self, training: TrainingSet, contact: CollisionTerm | None, config: RopesConfig, seed: int):
        self.training, self.contact, self.config = training, contact, config
        self.name = f"{training.stage} network"
        deviations = np.maximum(training.deviations, 1e-6).astype(np.float32)
        trained = training.bones[training.train]
        self.network = ScaledNetwork(trained, deviations, hidden=config.hidden, seed=seed)
        noise = noise_on_bones(training.free, config.bone_noise)
        self.network.start_linear(trained, training.coefficients[training.train], noise)

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Parameters of the network."""
        return self.network.parameters

    @property
    def samples(self) -> np.ndarray:
        """The frames to train on."""
        return self.training.train

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the sum of both terms, on bones with noise."""
        bones = with_noise(self.training.bones[chosen], self.config.bone_noise, self.training.free, random)
        return self._both_terms(chosen[mine], self.network(torch.from_numpy(bones[mine])), random)

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the loss, data term plus collision term, on held-out frames without noise."""
        frames = self.training.val if len(self.training.val) else self.training.train
        return self._both_terms(frames, self.network(torch.from_numpy(self.training.bones[frames])), random)

    def _both_terms(self, chosen: np.ndarray, coefficients: torch.Tensor, random: np.random.Generator) -> torch.Tensor:
        loss = self.config.data_weight * self._square_errors(chosen, coefficients).mean() / self.training.vertex_count
        if self.contact:
            loss = loss + self.config.collision_weight * self.collision(chosen, coefficients, random)
        return loss

    def _square_errors(self, chosen: np.ndarray, coefficients: torch.Tensor) -> torch.Tensor:
        """Returns the square distance of the coefficients of each frame to those of the ground truth."""
        return ((coefficients - torch.from_numpy(self.training.coefficients[chosen])) ** 2).sum(dim=1)

    def collision(self, chosen: np.ndarray, coefficients: torch.Tensor, random: np.random.Generator) -> torch.Tensor:
        """Returns the collision term over random vertices, an unbiased estimate."""
        contact, config = self.contact, self.config
        assert contact is not None
        vertices, rows = sample_vertices(self.training.vertex_count, config.collision_vertices, random)
        offsets = coefficients @ torch.from_numpy(contact.basis[:, rows])
        if contact.before is not None:  # torch's product: NumPy's threads would wait for torch's, and they for it
            earlier, basis = contact.before
            offsets = offsets + torch.from_numpy(earlier[chosen]) @ torch.from_numpy(basis[:, rows])
        truth = torch.from_numpy(contact.displacements[chosen[:, None], rows])
        offsets = (offsets - truth).reshape(len(chosen), len(vertices), 3)
        return collision_loss(offsets, contact.clearances, chosen, vertices, config.expansion)
