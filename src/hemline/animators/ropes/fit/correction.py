"""Training of the third network: a correction of the ropes' bones towards those of the simulation."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from hemline.animators.ropes.config import RopesConfig
from hemline.learning.collision import Clearances, collision_loss
from hemline.learning.fit.batches import sample_vertices, with_noise
from hemline.learning.fit.network import ScaledNetwork, deviations_of, layers_of, through
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer
from hemline.learning.mlp import Mlp

from .frames import KeyFrames
from .training_set import MeshNetworks


def train_correction(
    frames: KeyFrames,
    mesh_networks: MeshNetworks,
    clearances: Clearances | None,
    config: RopesConfig,
    *,
    seed: int,
    mark: str,
    progress: Callable[[int, int], None],
    folder: Path | None,
) -> Mlp:
    r"""Fits the network $g$ that corrects the ropes' bones: the mesh is $x(d + g(d))$ instead of $x(d)$.

    Ropes hang centimetres away from the cloth, so the mesh that the networks make of their bones cuts the body or
    tears. The loss has three terms for $x(d + g(d))$: the distance to the ground truth, the distance to $x(d)$, which
    preserves the swing of the ropes, and the collision with the body.

    Args:
        frames: Bones of the ropes, displacements, the split.
        mesh_networks: The fitted networks from bones to mesh, which are not changed.
        clearances: Clearances from the body for the collision term; None omits it.
        config: Options.
        seed: Seed of the weights, of the order of frames and of the noise.
        mark: Hash of everything that the training depends on; a checkpoint with another one is not used.
        progress: Called with the epochs done and in all.
        folder: Where the checkpoint is saved; None: nowhere.

    Returns:
        The network; its outputs are zero for bones that the body carries.

    Raises:
        BadModel: The loss is no longer finite.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 names the gap between bones of ropes and of the simulation, and leaves it open. A
        separate network leaves the other two unchanged on simulated bones.
    """
    objective = CorrectionObjective(frames, mesh_networks, clearances, config, seed)
    schedule = Schedule(config.correction_epochs, config.batch, config.correction_rate, seed, config.threads)
    checkpoint = Checkpoint(folder / "correction.safetensors", mark, config.checkpoint_epochs) if folder else None
    Trainer(objective, schedule).run(checkpoint=checkpoint, progress=progress)
    return objective.network.to_mlp()


class CorrectionObjective:
    """The loss of the correction: distance to the ground truth, change of what is played, and collision."""

    name = "bone correction"

    def __init__(
        self,
        frames: KeyFrames,
        mesh_networks: MeshNetworks,
        clearances: Clearances | None,
        config: RopesConfig,
        seed: int,
    ):
        self.frames, self.mesh_networks, self.clearances, self.config = frames, mesh_networks, clearances, config
        trained = frames.rope_bones[frames.train]
        scale = deviations_of(trained) * frames.free
        self.network = ScaledNetwork(trained, scale, hidden=config.correction_hidden, seed=seed)
        self.network.start_at_zero()
        self.fixed = [layers_of(network) for network in mesh_networks.networks]

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Parameters of the correction."""
        return self.network.parameters

    @property
    def samples(self) -> np.ndarray:
        """The frames to train on."""
        return self.frames.train

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the sum of all terms, on bones with noise."""
        bones = with_noise(self.frames.rope_bones[chosen], self.config.bone_noise, self.frames.free, random)
        return self._terms(chosen[mine], bones[mine], random)

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the sum of all terms on held-out frames, without noise."""
        chosen = self.frames.val if len(self.frames.val) else self.frames.train
        return self._terms(chosen, self.frames.rope_bones[chosen], random)

    def _terms(self, chosen: np.ndarray, bones: np.ndarray, random: np.random.Generator) -> torch.Tensor:
        """Returns the sum of all terms over random vertices, an unbiased estimate."""
        config, frames = self.config, self.frames
        vertices, rows = sample_vertices(frames.vertex_count, config.collision_vertices, random)
        basis = torch.from_numpy(self.mesh_networks.basis[:, rows])
        given = torch.from_numpy(bones)
        with torch.no_grad():
            unchanged = self._coefficients(given) @ basis
        corrected = self._coefficients(given + self.network(given)) @ basis
        truth = torch.from_numpy(frames.displacements[chosen[:, None], rows])
        offsets = (corrected - truth).reshape(len(chosen), len(vertices), 3)
        loss = config.data_weight * (offsets**2).sum(dim=2).mean()
        loss = loss + config.prior_weight * ((corrected - unchanged) ** 2).mean() * 3
        if self.clearances is None:
            return loss
        collision = collision_loss(offsets, self.clearances, chosen, vertices, config.expansion)
        return loss + config.correction_collision_weight * collision

    def _coefficients(self, bones: torch.Tensor) -> torch.Tensor:
        return torch.cat([through(layers, bones) for layers in self.fixed], dim=1)
