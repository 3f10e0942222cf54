"""Training of `ChainGrus` with torch."""

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch

from hemline.animators.base import Progress
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.arrays import Int
from hemline.errors import BadDataset
from hemline.files import content_hash
from hemline.learning.fit.network import deviations_of
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer

from .gru import WARM_UP, ChainGrus, GruCells, chain_slots
from .motion_inputs import COLUMNS
from .sequences import Sequences, sequences


@dataclass(frozen=True)
class GruOptions:
    """Options of a training."""

    hidden: int = 64
    """Size of the hidden state of each chain."""
    window: int = 30
    """Steps with gradient, after `WARM_UP` steps without."""
    epochs: int = 40
    """Passes over the training set."""
    batch: int = 32
    """Windows in each step of the optimiser."""
    rate: float = 2e-3
    """First learning rate."""
    checkpoint_epochs: int = 5
    """Number of epochs after which the state of the training is saved."""
    mirror: bool = True
    """Add mirror images of the takes to train on, where garment and body are symmetric."""
    inputs: str = "motion"
    """What the networks see of the body, a key of `COLUMNS`."""
    frames: int | None = None
    """Number of frames to train on, in windows spread evenly over the takes; None: all."""
    threads: int = 1
    """Threads of torch."""


PRINTED_FRAMES = 4000
"""Number of frames that the paper trains on: 80 % of its 5,000 (Section 9)."""
PRINTED = GruOptions(mirror=False, inputs="pose", frames=PRINTED_FRAMES)
"""The networks of the paper: inputs are the pose, `PRINTED_FRAMES` frames, no mirror images (Section 9)."""


def train_grus(
    source: TakeFrames,
    ropes: Ropes,
    options: GruOptions,
    *,
    seed: int,
    progress: Progress | None = None,
    folder: Path | None = None,
) -> ChainGrus:
    """Trains on the simulated bones of all takes.

    Args:
        source: The takes.
        ropes: The bones of the garment.
        options: Options.
        seed: Seed of the weights and of the order of windows.
        progress: Called with "recurrent networks", epochs done and in all.
        folder: Where the state of the training is saved; None: nowhere.

    Raises:
        BadDataset: No take is long enough.
        BadModel: The training diverged.
    """
    data = sequences(source, ropes, mirror=options.mirror)
    report = progress or (lambda stage, done, total: None)
    cells = train_cells(
        data,
        chain_slots(ropes.parents),
        options,
        seed=seed,
        mark=content_hash(asdict(options), {"seed": seed}, source.mark, data.bones),
        progress=lambda done, total: report("recurrent networks", done, total),
        folder=folder,
    )
    return ChainGrus(ropes, cells, data.dt, COLUMNS[options.inputs])


def train_cells(
    data: Sequences,
    slots: Int[np.ndarray, "chains longest"],
    options: GruOptions,
    *,
    seed: int,
    mark: str,
    progress: Callable[[int, int], None],
    folder: Path | None,
) -> GruCells:
    """Trains the networks of all chains and returns those of the epoch that is best on validation.

    Args:
        data: Bones and inputs.
        slots: The bones of each chain, see `chain_slots`.
        options: Options.
        seed: Seed of the weights and of the order of windows.
        mark: Hash of everything that the training depends on; a checkpoint with another one is not used.
        progress: Called with the epochs done and in all.
        folder: Where the checkpoint is saved; None: nowhere.

    Raises:
        BadDataset: No take is long enough.
        BadModel: The training diverged.
    """
    if data.longest < WARM_UP + options.window:
        what = f"windows of {options.window} steps need takes of {WARM_UP + options.window + 3} frames"
        got = f"none longer than {max(0, data.longest + 3)} frames"
        raise BadDataset(what, got, "simulate longer clips, or lower 'window'")
    objective = GruObjective(data, slots, options, seed)
    schedule = Schedule(options.epochs, options.batch, options.rate, seed, options.threads)
    checkpoint = Checkpoint(folder / "grus.safetensors", mark, options.checkpoint_epochs) if folder else None
    Trainer(objective, schedule).run(checkpoint=checkpoint, progress=progress)
    return objective.cells()


class GruObjective:
    """Mean square distance of the bones to the simulated ones after the warm-up, over windows.

    The chains are independent: each has its own gradient, and a step of all costs little more than a step of one.
    """

    name = "recurrent networks"

    def __init__(self, data: Sequences, slots: Int[np.ndarray, "chains longest"], options: GruOptions, seed: int):
        trained = data.side == 0
        self.data, self.slots, self.window, self.frames = data, slots, options.window, options.frames
        self.body = data.body[:, COLUMNS[options.inputs]]
        self.used = torch.from_numpy(np.repeat(slots >= 0, 3, axis=1))
        self.mean, self.spread = self.body[trained].mean(axis=0), deviations_of(self.body[trained])
        self.wanted = data.bones[:, slots].reshape(len(data.bones), len(slots), -1)
        # padded outputs repeat the last free bone; their error does not count
        self.scale = torch.from_numpy(np.maximum(self.wanted[trained].std(axis=0), 1e-4))
        self.centre = torch.from_numpy(self.wanted[trained].mean(axis=0))
        chains, outs, ins, hidden = len(slots), self.wanted.shape[2], self.body.shape[1], options.hidden
        generator = torch.Generator().manual_seed(seed)
        shapes = [(3 * hidden, ins), (3 * hidden,), (3 * hidden, hidden), (3 * hidden,), (outs, hidden), (outs,)]
        reach = 1 / math.sqrt(hidden)
        drawn = [(2 * torch.rand(chains, *each, generator=generator) - 1) * reach for each in shapes]
        self.parameters = [each.requires_grad_() for each in drawn]

    @property
    def samples(self) -> Int[np.ndarray, " windows"]:
        """Frames before windows, spaced so that windows do not overlap."""
        every = self.data.windows(0, WARM_UP + self.window)[:: self.window]
        count = len(every) if self.frames is None else min(len(every), max(1, self.frames // self.window))
        return every[np.linspace(0, len(every) - 1, count).astype(int)]

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the loss of some windows, without random numbers [m^2]."""
        return self._error(chosen[mine], self.window)

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the loss of all validation windows, or of the training windows if there are none [m^2]."""
        found = self.data.windows(1, WARM_UP + self.window)[:: self.window]
        return self._error(found if len(found) else self.samples, self.window)

    def _error(self, frames: np.ndarray, length: int) -> torch.Tensor:
        found = self.roll_out(frames, length)
        wanted = self.wanted[frames + WARM_UP + np.arange(1, length + 1)[:, None]]
        off = (found - torch.from_numpy(wanted).permute(0, 2, 1, 3)) * self.used[:, None]
        return off.square().sum() / (self.used.sum() * off.shape[0] * off.shape[2])

    def roll_out(self, frames: np.ndarray, length: int) -> torch.Tensor:
        """Returns the displacements (steps, chains, windows, outs) after the warm-up [m].

        Args:
            frames: The frame before the warm-up of each window.
            length: Number of steps after the warm-up.
        """
        input_weights, input_bias, hidden_weights, hidden_bias, output_weights, output_bias = self.parameters
        body = self.body[frames + np.arange(1, WARM_UP + length + 1)[:, None]]
        x = torch.from_numpy((body - self.mean) / self.spread)
        hidden = torch.zeros(len(self.slots), len(frames), hidden_weights.shape[2])
        with torch.no_grad():
            for seen in self._inputs(x[:WARM_UP], input_weights, input_bias):
                hidden = step_cells(hidden, seen, hidden_weights, hidden_bias)
        states = []
        for seen in self._inputs(x[WARM_UP:], input_weights, input_bias):
            hidden = step_cells(hidden, seen, hidden_weights, hidden_bias)
            states.append(hidden)
        shown = torch.einsum("tcbh,coh->tcbo", torch.stack(states), output_weights) + output_bias[:, None]
        return shown * self.scale[:, None] + self.centre[:, None]

    @staticmethod
    def _inputs(x: torch.Tensor, input_weights: torch.Tensor, bias: torch.Tensor) -> torch.Tensor:
        """Returns the contributions of the inputs (steps, windows, ins) to all gates (steps, chains, windows, rows)."""
        steps, windows, ins = x.shape
        flat = x.reshape(-1, ins) @ input_weights.reshape(-1, ins).T + bias.reshape(-1)
        return flat.reshape(steps, windows, *bias.shape).permute(0, 2, 1, 3)

    def cells(self) -> GruCells:
        """Returns the networks for playing."""
        input_weights, input_bias, hidden_weights, hidden_bias, output_weights, output_bias = (
            each.detach().numpy().copy() for each in self.parameters
        )
        scale = self.scale.numpy()
        output_weights, output_bias = output_weights * scale[:, :, None], output_bias * scale + self.centre.numpy()
        weights = (input_weights, input_bias, hidden_weights, hidden_bias)
        return GruCells(self.mean, self.spread, *weights, output_weights, output_bias, self.slots)


def step_cells(
    hidden: torch.Tensor, seen: torch.Tensor, hidden_weights: torch.Tensor, bias: torch.Tensor
) -> torch.Tensor:
    """Returns the hidden states (chains, windows, hidden) after a step; `seen` is the input part of the gates."""
    recalled = torch.baddbmm(bias[:, None], hidden, hidden_weights.transpose(1, 2))
    (r, z, n), (r_old, z_old, n_old) = seen.chunk(3, dim=2), recalled.chunk(3, dim=2)
    r, z = torch.sigmoid(r + r_old), torch.sigmoid(z + z_old)
    n = torch.tanh(n + r * n_old)
    return n + z * (hidden - n)
