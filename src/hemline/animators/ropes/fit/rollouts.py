"""The training of learned bones with torch: through rollouts, so that a step meets what the steps before it made."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from hemline.animators.ropes.bones.body_inputs import AT_REST, COUNT
from hemline.animators.ropes.bones.bone_contact_kernels import push_rollouts_out
from hemline.animators.ropes.config import RopesConfig
from hemline.arrays import Float, Int
from hemline.learning.fit.network import ScaledNetwork
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer
from hemline.learning.mlp import Mlp

from .sequences import Sequences

STAGES = (5, 2, 1)
"""The longest rollout is divided by these, one stage of the training after the other."""
STRIDE = 0.4
"""Rollouts begin so many of their lengths apart: each frame is seen that much less often in a pass, no frame never."""
RARE = 0.1
"""Percentage of the training set that is out of the range of an input at either end."""
VALIDATION_FRAMES, SETTLING = 60, 15
"""Length of the rollouts that choose the best epoch, and how many of their first frames do not count."""


def train_rollouts(
    data: Sequences,
    modes: Float[np.ndarray, "modes rows"],
    config: RopesConfig,
    *,
    seed: int,
    mark: str,
    progress: Callable[[int, int], None],
    folder: Path | None,
) -> tuple[Mlp, Float[np.ndarray, " ins"], Float[np.ndarray, " ins"]]:
    r"""Fit the network $g$ of `LearnedBones`.

    It begins as the ridge regression of single steps from simulated bones, which diverges when it goes on from what it
    made. Then rollouts from simulated bones with noise, each stage longer than the one before.

    Args:
        data: Bones and inputs.
        modes: Principal directions of the bones.
        config: Options.
        seed: Seed of the weights, of the order of rollouts and of the noise.
        mark: Hash of all that the training depends on; a checkpoint with another one is not used.
        progress: Called with the epochs done and in all.
        folder: Where the checkpoints are kept; None: nowhere.

    Returns:
        The network, and the range of each input, low and high.

    Raises:
        BadModel: The loss is no longer finite.

    Source: Holden, Duong, Datta, Nowrouzezahrai, "Subspace Neural Physics: Fast Data-Driven Interactive Simulation",
        2019 (a network on principal coefficients, trained over windows of frames with noise). Differs: inertia acts in
        the world and is carried into the new frame of the key joint; bones leave the body in every step; the network
        begins as a line.
    """
    objective = RolloutObjective(data, modes, config, seed)
    total = config.bones_epochs * len(STAGES)
    for stage, share in enumerate(STAGES):
        objective.length = max(2, min(config.rollout_frames, data.longest) // share)
        rate, done = config.bones_rate / 2**stage, config.bones_epochs * stage
        schedule = Schedule(config.bones_epochs, config.bones_batch, rate, seed + stage, config.threads)
        file = f"bones{stage}.safetensors"
        checkpoint = Checkpoint(folder / file, mark, config.checkpoint_epochs) if folder else None
        Trainer(objective, schedule).run(checkpoint=checkpoint, progress=lambda k, _, at=done: progress(at + k, total))
    still = objective.still.numpy()
    return objective.network.folded().vanishing_at(still), objective.low, objective.high


class RolloutObjective:
    """Mean square distance of the coefficients to those of the simulated bones, over rollouts."""

    name = "learned bones"

    def __init__(self, data: Sequences, modes: Float[np.ndarray, "modes rows"], config: RopesConfig, seed: int):
        self.data, self.config, self.length = data, config, 2
        self.modes = torch.from_numpy(modes)
        self.wanted = torch.from_numpy(data.bones.reshape(len(data.bones), -1) @ modes.T)
        inputs, outputs = self._single_steps()
        still = np.concatenate([AT_REST, np.zeros(2 * len(modes), np.float32)])
        self.still = torch.from_numpy(still)
        self.low, self.high = _ranges(inputs, still)
        inputs = np.clip(inputs, self.low, self.high)
        scale = np.maximum(outputs.std(axis=0), 1e-4)
        self.network = ScaledNetwork(inputs, scale, hidden=config.bones_hidden, seed=seed)
        noise = config.body_noise * self.network.spread
        self.noise = noise[:COUNT].copy()
        noise[-2 * len(modes) :] = np.maximum(noise[-2 * len(modes) :], config.rollout_noise)
        # what rests counts as much as all that moves, so that the line goes through it
        inputs = np.concatenate([inputs, np.tile(still, (len(inputs), 1))])
        self.network.start_linear(inputs, np.concatenate([outputs, np.zeros_like(outputs)]), noise)

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Those of the network."""
        return self.network.parameters

    @property
    def samples(self) -> Int[np.ndarray, " windows"]:
        """The frames to start rollouts from."""
        return self.data.windows(0, self.length)[:: max(1, round(STRIDE * self.length))]

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Over rollouts that start from bones with noise, on a body with noise.

        Besides how far coefficients are off, it counts how much that changes from step to step: else swing is averaged
        away.
        """
        misses = self._misses(chosen[mine], self.length, self._noise(len(chosen), random).of(mine))
        return misses.square().sum(2).mean() + self.config.swing_weight * misses.diff(dim=0).square().sum(2).mean()

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Over long rollouts on held-out takes, without noise."""
        side = 1 if len(self.data.windows(1, VALIDATION_FRAMES)) else 0
        windows = self.data.windows(side, VALIDATION_FRAMES)
        length = VALIDATION_FRAMES
        if not len(windows):
            windows, length = self.data.windows(0, self.length), self.length
        misses = self._misses(windows[:: VALIDATION_FRAMES // 2], length, None)[min(SETTLING, length - 1) :]
        return misses.square().sum(2).mean()

    def _misses(self, frames: np.ndarray, length: int, noise: "_Noise | None") -> torch.Tensor:
        """How far coefficients are off (steps, rollouts, modes) [m]."""
        found = self.rollout(frames, length, noise)
        wanted = self.wanted[torch.from_numpy(frames + np.arange(1, length + 1)[:, None])]
        return found - wanted

    def rollout(self, frames: np.ndarray, length: int, noise: "_Noise | None" = None) -> torch.Tensor:
        """Coefficients (steps, rollouts, modes) of steps that go on from what they made [m].

        Args:
            frames: Frames to start from.
            length: Steps.
            noise: On start and body of each rollout; None: none.
        """
        rest = torch.from_numpy(self.data.rest[self.data.shape[frames]])
        now, before = self._start(frames, rest, noise)
        found, body_noise = [], 0.0 if noise is None else noise.body
        for step in range(1, length + 1):
            inputs, carried, inertia = self._carried(frames + step, rest, now, before)
            kept = inputs.clamp(*self._reach(slice(None)))
            new = (inertia + self.added(kept + body_noise)).clamp(*self._reach(slice(COUNT, COUNT + len(self.modes))))
            moved = rest + (new @ self.modes).reshape(now.shape)
            now, before = moved + self._push(frames + step, moved.detach()), carried
            found.append((now - rest).flatten(1) @ self.modes.T)
        return torch.stack(found)

    def added(self, inputs: torch.Tensor) -> torch.Tensor:
        """What the network adds to inertia (rollouts, modes) [m]: nothing at rest."""
        return self.network(inputs) - self.network(self.still[None])

    def _reach(self, inputs: slice) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.from_numpy(self.low[inputs]), torch.from_numpy(self.high[inputs])

    def _noise(self, count: int, random: np.random.Generator) -> "_Noise":
        start = torch.from_numpy(random.standard_normal((2, count, len(self.modes)), np.float32))
        body = np.zeros((count, COUNT + 2 * len(self.modes)), np.float32)
        body[:, :COUNT] = random.standard_normal((count, COUNT), np.float32) * self.noise
        return _Noise(start * self.config.rollout_noise, torch.from_numpy(body))

    def _push(self, frames: np.ndarray, moved: torch.Tensor) -> torch.Tensor:
        """How far bones are pushed out of the body's primitives (rollouts, free, 3) [m]; taken as given by the loss."""
        points = moved.numpy().astype(np.float64)
        kinds, joints, shapes, centres, _ = self.data.colliders
        bodies = self.data.frames[frames].astype(np.float64)
        which = self.data.shape[frames]
        push_rollouts_out(kinds, joints, shapes, centres, which, bodies, self.data.margins, points)
        return torch.from_numpy(points.astype(np.float32)) - moved

    def _start(
        self, frames: np.ndarray, rest: torch.Tensor, noise: "_Noise | None"
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Simulated bones at some frames and one before, both in the key frame of the first (rollouts, free, 3)."""
        bones = [rest + torch.from_numpy(self.data.bones[frames - back]) for back in (0, 1)]
        if noise is not None:
            pairs = zip(bones, noise.start, strict=True)
            bones = [each + (drawn @ self.modes).reshape(each.shape) for each, drawn in pairs]
        return bones[0], self._turned(frames, bones[1]) + torch.from_numpy(self.data.shifts[frames])[:, None]

    def _carried(
        self, frames: np.ndarray, rest: torch.Tensor, now: torch.Tensor, before: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Inputs of the step to some frames; the last bones in the key frame of each; where inertia takes them."""
        carried = self._turned(frames, now) + torch.from_numpy(self.data.shifts[frames])[:, None]
        place = (carried - rest).flatten(1) @ self.modes.T
        way = self._turned(frames, now - before).flatten(1) @ self.modes.T
        return torch.cat([torch.from_numpy(self.data.body[frames]), place, way], dim=1), carried, place + way

    def _turned(self, frames: np.ndarray, vectors: torch.Tensor) -> torch.Tensor:
        return vectors @ torch.from_numpy(self.data.turns[frames]).transpose(1, 2)

    def _single_steps(self) -> tuple[np.ndarray, np.ndarray]:
        """Inputs and wanted outputs of all steps of the training set from simulated bones."""
        inputs, outputs = [], []
        for frames in np.array_split(self.data.windows(0, 1), 16):
            rest = torch.from_numpy(self.data.rest[self.data.shape[frames]])
            given, _, inertia = self._carried(frames + 1, rest, *self._start(frames, rest, None))
            inputs.append(given.numpy())
            outputs.append((self.wanted[torch.from_numpy(frames + 1)] - inertia).numpy())
        return np.concatenate(inputs), np.concatenate(outputs)


@dataclass(frozen=True)
class _Noise:
    """What is drawn for rollouts."""

    start: torch.Tensor
    """On the modes of the two frames that they start from (2, rollouts, modes) [m]."""
    body: torch.Tensor
    """On the inputs (rollouts, ins), the same in all steps: as bodies differ."""

    def of(self, mine: slice) -> "_Noise":
        """Of some of them."""
        return _Noise(self.start[:, mine], self.body[mine])


def _ranges(inputs: np.ndarray, still: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Low and high of each input, rest in between: of the body without its rarest values, of the bones all there is."""
    shares = np.full(inputs.shape[1], 0.0)
    shares[:COUNT] = RARE
    low = [np.percentile(column, share) for column, share in zip(inputs.T, shares, strict=True)]
    high = [np.percentile(column, 100 - share) for column, share in zip(inputs.T, shares, strict=True)]
    return np.minimum(np.array(low, np.float32), still), np.maximum(np.array(high, np.float32), still)
