"""Training of learned bones with torch, through rollouts: each step starts from the output of the one before."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from hemline.animators.ropes.bones.body_inputs import BODY_INPUT_COUNT, REST_INPUTS
from hemline.animators.ropes.bones.bone_contact_kernels import push_rollouts_out
from hemline.animators.ropes.config import RopesConfig
from hemline.arrays import Float, Int
from hemline.learning.fit.network import ScaledNetwork
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer
from hemline.learning.mlp import Mlp

from .sequences import Sequences

STAGE_DIVISORS = (5, 2, 1)
"""Divisors of the longest rollout, one for each stage of the training."""
START_STRIDE = 0.4
"""Distance between the starts of rollouts, as a fraction of their length: each frame is still used in every pass."""
OUTLIER_PERCENT = 0.1
"""Percentage of the training set outside of the range of an input, at either end."""
VALIDATION_FRAMES, SETTLING_FRAMES = 60, 15
"""Length of the rollouts that choose the best epoch, and the number of their first frames that do not count."""


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
    r"""Fits the network $g$ of `LearnedBones`.

    It begins as the ridge regression of single steps from simulated bones, which diverges in a closed loop. Then it is
    trained on rollouts from simulated bones with noise, longer from stage to stage.

    Args:
        data: Bones and inputs.
        modes: Principal directions of the bones.
        config: Options.
        seed: Seed of the weights, of the order of rollouts and of the noise.
        mark: Hash of everything that the training depends on; a checkpoint with another one is not used.
        progress: Called with the epochs done and in all.
        folder: Where the checkpoints are saved; None: nowhere.

    Returns:
        The network, and the range of each input, low and high.

    Raises:
        BadModel: The loss is no longer finite.

    Source: Holden, Duong, Datta, Nowrouzezahrai, "Subspace Neural Physics: Fast Data-Driven Interactive Simulation",
        2019 (a network on principal coefficients, trained over windows of frames with noise). Differs: inertia acts in
        the world and is carried into the new frame of the key joint; bones are pushed out of the body in every step;
        the network begins as a linear map.
    """
    objective = RolloutObjective(data, modes, config, seed)
    total = config.bones_epochs * len(STAGE_DIVISORS)
    for stage, divisor in enumerate(STAGE_DIVISORS):
        objective.length = max(2, min(config.rollout_frames, data.longest) // divisor)
        rate, done = config.bones_rate / 2**stage, config.bones_epochs * stage
        schedule = Schedule(config.bones_epochs, config.bones_batch, rate, seed + stage, config.threads)
        file = f"bones{stage}.safetensors"
        checkpoint = Checkpoint(folder / file, mark, config.checkpoint_epochs) if folder else None
        Trainer(objective, schedule).run(checkpoint=checkpoint, progress=lambda k, _, at=done: progress(at + k, total))
    still = objective.still.numpy()
    return objective.network.to_mlp().with_zero_at(still), objective.low, objective.high


class RolloutObjective:
    """Mean square distance of the coefficients to those of the simulated bones, over rollouts."""

    name = "learned bones"

    def __init__(self, data: Sequences, modes: Float[np.ndarray, "modes rows"], config: RopesConfig, seed: int):
        self.data, self.config, self.length = data, config, 2
        self.modes = torch.from_numpy(modes)
        self.wanted = torch.from_numpy(data.bones.reshape(len(data.bones), -1) @ modes.T)
        inputs, outputs = self._single_steps()
        still = np.concatenate([REST_INPUTS, np.zeros(2 * len(modes), np.float32)])
        self.still = torch.from_numpy(still)
        self.low, self.high = _ranges(inputs, still)
        inputs = np.clip(inputs, self.low, self.high)
        scale = np.maximum(outputs.std(axis=0), 1e-4)
        self.network = ScaledNetwork(inputs, scale, hidden=config.bones_hidden, seed=seed)
        noise = config.body_noise * self.network.spread
        self.noise = noise[:BODY_INPUT_COUNT].copy()
        noise[-2 * len(modes) :] = np.maximum(noise[-2 * len(modes) :], config.rollout_noise)
        # the rest state counts as much as all moving ones, so that the linear map goes through it
        inputs = np.concatenate([inputs, np.tile(still, (len(inputs), 1))])
        self.network.start_linear(inputs, np.concatenate([outputs, np.zeros_like(outputs)]), noise)

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Parameters of the network."""
        return self.network.parameters

    @property
    def samples(self) -> Int[np.ndarray, " windows"]:
        """The frames from which rollouts start."""
        return self.data.windows(0, self.length)[:: max(1, round(START_STRIDE * self.length))]

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the loss over rollouts that start from bones with noise, on a body with noise.

        It is the error of the coefficients plus that of their change from step to step, without which swing would be
        averaged away.
        """
        errors = self._errors(chosen[mine], self.length, self._noise(len(chosen), random).of(mine))
        return errors.square().sum(2).mean() + self.config.swing_weight * errors.diff(dim=0).square().sum(2).mean()

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the loss over long rollouts on held-out takes, without noise."""
        side = 1 if len(self.data.windows(1, VALIDATION_FRAMES)) else 0
        windows = self.data.windows(side, VALIDATION_FRAMES)
        length = VALIDATION_FRAMES
        if not len(windows):
            windows, length = self.data.windows(0, self.length), self.length
        errors = self._errors(windows[:: VALIDATION_FRAMES // 2], length, None)[min(SETTLING_FRAMES, length - 1) :]
        return errors.square().sum(2).mean()

    def _errors(self, frames: np.ndarray, length: int, noise: "_Noise | None") -> torch.Tensor:
        """Returns the errors of the coefficients (steps, rollouts, modes) [m]."""
        coefficients = self.rollout(frames, length, noise)
        wanted = self.wanted[torch.from_numpy(frames + np.arange(1, length + 1)[:, None])]
        return coefficients - wanted

    def rollout(self, frames: np.ndarray, length: int, noise: "_Noise | None" = None) -> torch.Tensor:
        """Returns the coefficients (steps, rollouts, modes) of steps that each start from the one before [m].

        Args:
            frames: Frames to start from.
            length: Number of steps.
            noise: Noise on start and body of each rollout; None: none.
        """
        rest = torch.from_numpy(self.data.rest[self.data.shape[frames]])
        now, before = self._start(frames, rest, noise)
        coefficients, body_noise = [], 0.0 if noise is None else noise.body
        for step in range(1, length + 1):
            inputs, carried, inertia = self._step_inputs(frames + step, rest, now, before)
            clipped = inputs.clamp(*self._range_of(slice(None)))
            new = (inertia + self.correction(clipped + body_noise)).clamp(
                *self._range_of(slice(BODY_INPUT_COUNT, BODY_INPUT_COUNT + len(self.modes)))
            )
            moved = rest + (new @ self.modes).reshape(now.shape)
            now, before = moved + self._push(frames + step, moved.detach()), carried
            coefficients.append((now - rest).flatten(1) @ self.modes.T)
        return torch.stack(coefficients)

    def correction(self, inputs: torch.Tensor) -> torch.Tensor:
        """Returns the change by the network relative to inertia (rollouts, modes), zero at rest [m]."""
        return self.network(inputs) - self.network(self.still[None])

    def _range_of(self, inputs: slice) -> tuple[torch.Tensor, torch.Tensor]:
        return torch.from_numpy(self.low[inputs]), torch.from_numpy(self.high[inputs])

    def _noise(self, count: int, random: np.random.Generator) -> "_Noise":
        start = torch.from_numpy(random.standard_normal((2, count, len(self.modes)), np.float32))
        body = np.zeros((count, BODY_INPUT_COUNT + 2 * len(self.modes)), np.float32)
        body[:, :BODY_INPUT_COUNT] = random.standard_normal((count, BODY_INPUT_COUNT), np.float32) * self.noise
        return _Noise(start * self.config.rollout_noise, torch.from_numpy(body))

    def _push(self, frames: np.ndarray, moved: torch.Tensor) -> torch.Tensor:
        """Returns the push of bones out of the body's primitives (rollouts, free, 3), without gradient [m]."""
        points = moved.numpy().astype(np.float64)
        kinds, joints, shapes, centres, _ = self.data.colliders
        bodies = self.data.frames[frames].astype(np.float64)
        which = self.data.shape[frames]
        push_rollouts_out(kinds, joints, shapes, centres, which, bodies, self.data.margins, points)
        return torch.from_numpy(points.astype(np.float32)) - moved

    def _start(
        self, frames: np.ndarray, rest: torch.Tensor, noise: "_Noise | None"
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns simulated bones at some frames and one before, both in the key frame of the former."""
        bones = [rest + torch.from_numpy(self.data.bones[frames - back]) for back in (0, 1)]
        if noise is not None:
            pairs = zip(bones, noise.start, strict=True)
            bones = [each + (drawn @ self.modes).reshape(each.shape) for each, drawn in pairs]
        return bones[0], self._to_next_key(frames, bones[1]) + torch.from_numpy(self.data.shifts[frames])[:, None]

    def _step_inputs(
        self, frames: np.ndarray, rest: torch.Tensor, now: torch.Tensor, before: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Returns the inputs of a step, the last bones in the new key frame, and their place by inertia."""
        carried = self._to_next_key(frames, now) + torch.from_numpy(self.data.shifts[frames])[:, None]
        place = (carried - rest).flatten(1) @ self.modes.T
        displacement = self._to_next_key(frames, now - before).flatten(1) @ self.modes.T
        return (
            torch.cat([torch.from_numpy(self.data.body[frames]), place, displacement], dim=1),
            carried,
            place + displacement,
        )

    def _to_next_key(self, frames: np.ndarray, vectors: torch.Tensor) -> torch.Tensor:
        return vectors @ torch.from_numpy(self.data.turns[frames]).transpose(1, 2)

    def _single_steps(self) -> tuple[np.ndarray, np.ndarray]:
        """Returns inputs and target outputs of all steps of the training set from simulated bones."""
        inputs, outputs = [], []
        for frames in np.array_split(self.data.windows(0, 1), 16):
            rest = torch.from_numpy(self.data.rest[self.data.shape[frames]])
            given, _, inertia = self._step_inputs(frames + 1, rest, *self._start(frames, rest, None))
            inputs.append(given.numpy())
            outputs.append((self.wanted[torch.from_numpy(frames + 1)] - inertia).numpy())
        return np.concatenate(inputs), np.concatenate(outputs)


@dataclass(frozen=True)
class _Noise:
    """Random numbers of rollouts."""

    start: torch.Tensor
    """Noise on the modes of the two frames at the start (2, rollouts, modes) [m]."""
    body: torch.Tensor
    """Noise on the inputs (rollouts, ins), constant over the steps, as a body differs from another."""

    def of(self, mine: slice) -> "_Noise":
        """Returns the noise of some of the rollouts."""
        return _Noise(self.start[:, mine], self.body[mine])


def _ranges(inputs: np.ndarray, still: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns the range of each input, rest included: without the rarest values for the body, all for the bones."""
    percents = np.full(inputs.shape[1], 0.0)
    percents[:BODY_INPUT_COUNT] = OUTLIER_PERCENT
    low = [np.percentile(column, percent) for column, percent in zip(inputs.T, percents, strict=True)]
    high = [np.percentile(column, 100 - percent) for column, percent in zip(inputs.T, percents, strict=True)]
    return np.minimum(np.array(low, np.float32), still), np.maximum(np.array(high, np.float32), still)
