"""The training of learned bones with torch: through rollouts, so that a step meets what the steps before it made."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from hemline.arrays import Float
from hemline.learning.mlp import Mlp
from hemline.learning.network import ScaledNetwork
from hemline.learning.trainer import Checkpoint, Schedule, Trainer

from .config import RopesConfig
from .sequences import Sequences

VALIDATION_FRAMES = 60
"""Length of the rollouts that choose the best epoch."""


class RolloutObjective:
    """Mean square distance of the bones to the simulated ones over rollouts that start from those, with noise."""

    name = "learned bones"

    def __init__(self, data: Sequences, modes: np.ndarray, low: np.ndarray, high: np.ndarray, config: RopesConfig, seed: int):
        self.data, self.config, self.length = data, config, config.rollout_frames[0]
        self.modes = torch.from_numpy(modes)
        self.low, self.high, self.body = low, high, np.clip(data.body, low, high)
        self.flat = data.bones.reshape(len(data.bones), -1)
        self.wanted = self.flat @ modes.T
        inputs, outputs = self._single_steps()
        self.network = ScaledNetwork(inputs, np.maximum(outputs.std(axis=0), 1e-4), hidden=config.bones_hidden, seed=seed)
        noise = np.zeros(inputs.shape[1])
        noise[-2 * len(modes):] = config.rollout_noise
        noise = np.maximum(noise, 0.02 * self.network.spread)
        self.network.start_linear(inputs, outputs, noise)

    def _single_steps(self):
        """Inputs and outputs of single steps from the truth."""
        data = self.data
        at = data.windows(0, 1) + 1
        inputs = []
        outputs = []
        for some in np.array_split(at, max(1, len(at) // 2048)):
            q, b = self._start(some - 1, None)
            body, place, speed, _ = self._carried(some, q, b)
            inputs.append(torch.cat([body, place, speed], dim=1).numpy())
            outputs.append(self.wanted[some] - (place + speed).numpy())
        return np.concatenate(inputs), np.concatenate(outputs)

    def _start(self, frames, random):
        """Positions of the bones in the key frame at some frames, and those one step before in the same frame."""
        data = self.data
        rest = torch.from_numpy(data.rest[data.shape[frames]])
        now = rest + torch.from_numpy(data.bones[frames])
        before = rest + torch.from_numpy(data.bones[frames - 1])
        if random is not None:
            now = now + self._noise(frames, random)
            before = before + self._noise(frames, random)
        before = self._moved(frames, before)
        return now, before

    def _noise(self, frames, random):
        drawn = random.standard_normal((len(frames), len(self.modes)), np.float32) * np.float32(self.config.rollout_noise)
        return (torch.from_numpy(drawn) @ self.modes).reshape(len(frames), -1, 3)

    def _moved(self, frames, points):
        data = self.data
        return points @ torch.from_numpy(data.turns[frames]).transpose(1, 2) + torch.from_numpy(data.shifts[frames])[:, None]

    def _carried(self, frames, now, before):
        data = self.data
        place = self._moved(frames, now)
        speed = (now - before) @ torch.from_numpy(data.turns[frames]).transpose(1, 2)
        rest = torch.from_numpy(data.rest[data.shape[frames]])
        return (
            torch.from_numpy(self.body[frames]),
            (place - rest).flatten(1) @ self.modes.T,
            speed.flatten(1) @ self.modes.T,
            (place, rest),
        )

    def rollout(self, frames, length, random=None):
        """Coefficients (steps, windows, modes)."""
        now, before = self._start(frames, random)
        found = []
        for step in range(1, length + 1):
            at = frames + step
            body, place, speed, (carried, rest) = self._carried(at, now, before)
            new = place + speed + self.network(torch.cat([body, place, speed], dim=1))
            found.append(new)
            now, before = rest + (new @ self.modes).reshape(len(at), -1, 3), carried
            if random is not None and self.config.step_noise:
                drawn = random.standard_normal((len(frames), len(self.modes)), np.float32) * np.float32(self.config.step_noise)
                now = now + (torch.from_numpy(drawn) @ self.modes).reshape(len(frames), -1, 3)
        return torch.stack(found)

    def _loss(self, frames, length, random=None):
        found = self.rollout(frames, length, random)
        wanted = torch.from_numpy(np.stack([self.wanted[frames + k] for k in range(1, length + 1)]))
        miss = found - wanted
        loss = (miss**2).sum(2).mean()
        if self.config.swing_weight:
            loss = loss + self.config.swing_weight * ((miss[1:] - miss[:-1])**2).sum(2).mean()
        return loss

    @property
    def parameters(self):
        return self.network.parameters

    @property
    def samples(self):
        return self.data.windows(0, self.length)

    def loss(self, chosen, random):
        return self._loss(chosen, self.length, random)

    def validation_loss(self, random):
        side = 1 if (self.data.side == 1).any() else 0
        w = self.data.windows(side, VALIDATION_FRAMES)[::30]
        found = self.rollout(w, VALIDATION_FRAMES)
        wanted = torch.from_numpy(np.stack([self.wanted[w + k] for k in range(1, VALIDATION_FRAMES + 1)]))
        return ((found - wanted)**2).sum(2)[15:].mean()
