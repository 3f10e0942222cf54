"""The third network: from the bones of the ropes to bones that the other two understand."""

import math
from collections.abc import Callable

import numpy as np
import torch

from hemline.errors import BadModel

from .collision import Clearances, missing
from .config import RopesConfig
from .frames import Frames
from .lesson import Skinned
from .mlp import Mlp
from .nets import SMALLEST_DEVIATION, drawn_layers, folded


def train_bridge(
    frames: Frames,
    skinned: Skinned,
    clearances: Clearances | None,
    config: RopesConfig,
    *,
    seed: int,
    progress: Callable[[int, int], None],
) -> Mlp:
    r"""Fit the network $g$ that moves the ropes' bones: played is $x(d + g(d))$ instead of $x(d)$.

    Ropes hang centimetres away from where the cloth would, so the cloth that the networks make of their bones cuts the
    body or tears. The loss asks for three things of $x(d + g(d))$: to be near the truth, to be near $x(d)$, which keeps
    the swing of the ropes, and to be clear of the body.

    Args:
        frames: Bones of the ropes, displacements, the split.
        skinned: The networks, fitted; they stay as they are.
        clearances: Where the body is, for the collision term; None leaves it out.
        config: Options.
        seed: Seed of the weights, of the order of frames and of the noise.
        progress: Called with the passes done and in all.

    Returns:
        The network; its outputs are zero for bones that the body carries.

    Raises:
        BadModel: The loss is no longer finite.

    Source: Jin et al., "Rope chains", 2024, Section 7 names the gap between bones of ropes and of the simulation, and
        leaves it open. A network of its own leaves the other two as good on simulated bones as they were.
    """
    trainer = _Trainer(frames, skinned, clearances, config, seed)
    for done in range(config.bridge_epochs):
        trainer.set_rate(0.5 * config.bridge_rate * (1 + math.cos(math.pi * done / config.bridge_epochs)))
        trainer.run_epoch(done)
        trainer.remember_best()
        progress(done + 1, config.bridge_epochs)
    return trainer.network()


class _Trainer:
    def __init__(self, frames: Frames, skinned: Skinned, clearances: Clearances | None, config: RopesConfig, seed: int):
        torch.set_num_threads(config.threads)
        self.frames, self.skinned, self.clearances, self.config, self.seed = frames, skinned, clearances, config, seed
        trained = frames.rope_bones[frames.train]
        self.mean = trained.mean(axis=0)
        self.spread = np.maximum(trained.std(axis=0), SMALLEST_DEVIATION).astype(np.float32)
        self.free = torch.from_numpy(frames.free)
        count = trained.shape[1]
        generator = torch.Generator().manual_seed(seed)
        self.layers = drawn_layers((count, config.bridge_hidden, config.bridge_hidden, count), generator)
        with torch.no_grad():
            self.layers[-1][0].zero_()  # begins as no change at all
        self.parameters = [p for layer in self.layers for p in layer]
        self.adam = torch.optim.Adam(self.parameters, lr=config.bridge_rate)
        self.fixed = [
            [(torch.from_numpy(w), torch.from_numpy(b)) for w, b in zip(net.weights, net.biases, strict=True)]
            for net in skinned.networks
        ]
        self.best_loss = math.inf
        self.remember_best()

    def set_rate(self, rate: float) -> None:
        for group in self.adam.param_groups:
            group["lr"] = rate

    def run_epoch(self, epoch: int) -> None:
        random = np.random.default_rng((self.seed, epoch))
        order = random.permutation(self.frames.train)
        loss = torch.zeros(())
        for first in range(0, len(order), self.config.batch):
            chosen = np.sort(order[first : first + self.config.batch])
            bones = self.frames.rope_bones[chosen]
            noise = random.standard_normal(bones.shape, np.float32) * np.float32(self.config.bone_noise)
            loss = self.loss(chosen, bones + noise * self.frames.free, random)
            self.adam.zero_grad()
            loss.backward()
            self.adam.step()
        if not math.isfinite(float(loss.detach())):
            raise BadModel("the training of the bridge diverged", "a loss that is not finite", "lower bridge_rate")

    def loss(self, chosen: np.ndarray, bones: np.ndarray, random: np.random.Generator) -> torch.Tensor:
        """Over random vertices; unbiased in the choice."""
        config, frames = self.config, self.frames
        count = min(config.collision_vertices, frames.vertex_count)
        vertices = np.sort(random.choice(frames.vertex_count, count, replace=False))
        rows = (3 * vertices[:, None] + np.arange(3)).reshape(-1)
        basis = torch.from_numpy(self.skinned.basis[:, rows])
        given = torch.from_numpy(bones)
        with torch.no_grad():
            unchanged = self.coefficients(given) @ basis
        found = self.coefficients(given + self.moved(given)) @ basis
        astray = (found - torch.from_numpy(frames.displacements[chosen[:, None], rows])).reshape(len(chosen), count, 3)
        loss = config.data_weight * (astray**2).sum(dim=2).mean()
        loss = loss + config.loyalty * ((found - unchanged) ** 2).mean() * 3
        if self.clearances is None:
            return loss
        normals, heights = (torch.from_numpy(each) for each in self.clearances.rows(chosen, vertices))
        return loss + config.bridge_collision_weight * (
            (missing(astray, normals, heights, config.expansion) ** 2).mean()
        )

    def moved(self, bones: torch.Tensor) -> torch.Tensor:
        value = (bones - torch.from_numpy(self.mean)) / torch.from_numpy(self.spread)
        return _through(self.layers, value) * torch.from_numpy(self.spread) * self.free

    def coefficients(self, bones: torch.Tensor) -> torch.Tensor:
        return torch.cat([_through(layers, bones) for layers in self.fixed], dim=1)

    def remember_best(self) -> None:
        frames = self.frames
        chosen = frames.val if len(frames.val) else frames.train
        with torch.no_grad():
            loss = float(self.loss(chosen, frames.rope_bones[chosen], np.random.default_rng(self.seed)))
        if loss < self.best_loss:
            self.best_loss = loss
            self.best = [p.detach().clone() for p in self.parameters]

    def network(self) -> Mlp:
        with torch.no_grad():
            for parameter, best in zip(self.parameters, self.best, strict=True):
                parameter.copy_(best)
        return folded(self.layers, self.mean, self.spread, self.spread * self.frames.free)


def _through(layers: list[tuple[torch.Tensor, torch.Tensor]], value: torch.Tensor) -> torch.Tensor:
    for i, (weight, bias) in enumerate(layers):
        value = torch.nn.functional.linear(value, weight, bias)
        value = torch.relu(value) if i < len(layers) - 1 else value
    return value
