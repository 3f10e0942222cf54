"""The training loop of all networks: seeded, resumable to the same bits, with the best epoch kept."""

import json
import math
import os
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import numpy as np
import torch

from hemline.errors import BadCluster, BadModel, HemlineWarning
from hemline.files import read_tensors, tensor_bytes, write_tensors
from hemline.files.contents import array_of

from .group import Group


@runtime_checkable
class Objective(Protocol):
    """The subject of a training: parameters, samples and a loss."""

    @property
    def name(self) -> str:
        """Name of the network in error messages."""
        ...

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        """Tensors that the training changes in place."""
        ...

    @property
    def samples(self) -> np.ndarray:
        """Numbers of the training samples."""
        ...

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice) -> torch.Tensor:
        """Returns the mean loss of the samples `chosen[mine]` of a batch, at least one.

        All random numbers come from `random`, for the whole of `chosen`, so that a batch is the same on any number of
        processes.
        """
        ...

    def validation_loss(self, random: np.random.Generator) -> torch.Tensor:
        """Returns the loss by which epochs are compared; `random` is the same in every call."""
        ...


@dataclass(frozen=True)
class Schedule:
    """Length and learning rates of a training."""

    epochs: int
    """Passes over the training set."""
    batch: int
    """Samples a step of the optimiser."""
    rate: float
    """First learning rate of Adam, which falls to zero along a cosine."""
    seed: int
    """Seed of the order of samples and of all random numbers of an objective."""
    threads: int
    """Threads of torch; another number may give other bits."""
    warm_up: int = 0
    """Steps of the optimiser over which the learning rate rises to the cosine."""
    clip: float = math.inf
    """Largest norm of the gradient; a longer gradient is shortened to it."""
    patience: int = 0
    """The training ends early if the validation loss has not fallen by `gain` in this many epochs; 0: never."""
    gain: float = 0.02
    """Least relative fall of the validation loss that counts."""


class _DamagedCheckpoint(BadModel):
    """A checkpoint that was read and is incomplete or damaged."""


@dataclass(frozen=True)
class Checkpoint:
    """The file from which an interrupted training resumes."""

    path: Path
    """The file, written whole or not at all."""
    mark: str
    """Hash of everything the training depends on; a file with another hash is ignored."""
    epochs: int
    """Epochs between two checkpoints; another is written after the last epoch."""
    seconds: float = 0.0
    """Least time between two checkpoints [s]; it does not affect the result."""


class Trainer:
    r"""Adam over shuffled batches, with the learning rate $\eta_0 (1 + \cos(\pi e / E)) / 2$ in epoch $e$ of $E$.

    `losses` holds the validation loss at the start and after each epoch, `batch_losses` the mean loss over the batches
    of each epoch.

    Each epoch has its own random generator, seeded by the seed and the epoch, so that a training resumed from any
    checkpoint gives the same bits as one that was never interrupted.

    In a process group (`group`) each process takes its part of each batch; the gradients, weighted by the sizes of the
    parts, are summed, which is the gradient of the batch up to rounding:
    $\nabla \frac{1}{n} \sum_{i \le n} l_i = \sum_p \frac{n_p}{n} \nabla \frac{1}{n_p} \sum_{i \in p} l_i$. The
    first process validates and writes checkpoints, from which any number of processes can resume.

    Source: Kingma, Ba, "Adam", 2015; Loshchilov, Hutter, "SGDR", 2017, Eq. 5 (the cosine, without restarts).
    """

    def __init__(self, objective: Objective, schedule: Schedule):
        """Prepares a training.

        Raises:
            BadCluster: There are more processes than samples in a batch.
        """
        self.group = Group.current()
        if self.group.count > schedule.batch:
            what = f"the training of the {objective.name} has {schedule.batch} samples in a batch, one process each"
            raise BadCluster(what, f"{self.group.count} processes", "start fewer, or raise the batch")
        torch.set_num_threads(schedule.threads)
        self.objective, self.schedule = objective, schedule
        self.parameters = list(objective.parameters)
        self.adam = torch.optim.Adam(self.parameters, lr=schedule.rate)
        self.best = [p.detach().clone() for p in self.parameters]
        self.best_loss = math.inf
        self.done = 0
        self.losses: list[float] = []
        self.batch_losses: list[float] = []
        self._kept_at = time.monotonic()

    def run(self, *, checkpoint: Checkpoint | None = None, progress: Callable[[int, int], None]) -> None:
        """Trains to the end; the parameters are then those of the best epoch, or of the start.

        Args:
            checkpoint: The file to resume from and write to; None: no file.
            progress: Called with the epochs done and in all; an exception in it stops the training.

        Raises:
            BadModel: The loss is no longer finite, or the checkpoint cannot be read.
        """
        if not self.group.first:
            checkpoint = None
        if not (checkpoint and self._restore(checkpoint)):
            self._remember_best()
        self._agree()
        while not self.is_finished:
            self._run_epoch()
            self.done += 1
            self._remember_best()
            self._agree()
            if checkpoint and (self.is_finished or self._is_due(checkpoint)):
                self._keep(checkpoint)
            progress(self.done, self.schedule.epochs)
        with torch.no_grad():
            for parameter, best in zip(self.parameters, self.best, strict=True):
                parameter.copy_(best)

    @property
    def is_finished(self) -> bool:
        """Whether all epochs are done, or the validation loss has stopped falling."""
        schedule, losses = self.schedule, self.losses
        if self.done >= schedule.epochs:
            return True
        waited = 0 < schedule.patience < len(losses)
        return waited and min(losses) > (1 - schedule.gain) * min(losses[: -schedule.patience])

    def _is_due(self, checkpoint: Checkpoint) -> bool:
        waited = time.monotonic() - self._kept_at >= checkpoint.seconds
        return waited and self.done % checkpoint.epochs == 0

    def _run_epoch(self) -> None:
        schedule = self.schedule
        rate = 0.5 * schedule.rate * (1 + math.cos(math.pi * self.done / schedule.epochs))
        random = np.random.default_rng((schedule.seed, self.done))
        order = random.permutation(self.objective.samples)
        loss, total = 0.0, 0.0
        steps_before = self.done * -(-len(order) // schedule.batch)
        for step, first in enumerate(range(0, len(order), schedule.batch), steps_before + 1):
            for group in self.adam.param_groups:
                group["lr"] = rate * min(1.0, step / max(schedule.warm_up, 1))
            loss = self._step_down(np.sort(order[first : first + schedule.batch]), random)
            if schedule.clip < math.inf:
                torch.nn.utils.clip_grad_norm_(self.parameters, schedule.clip)
            self.adam.step()
            total += loss
        self.batch_losses.append(total / -(-len(order) // schedule.batch))
        if not math.isfinite(loss):
            what = f"the training of the {self.objective.name} diverged"
            raise BadModel(what, "a loss that is not finite", "lower its learning rate")

    def _step_down(self, chosen: np.ndarray, random: np.random.Generator) -> float:
        """Computes the gradients of a batch over all processes; returns its loss."""
        mine, group = self.group.own_slice(len(chosen)), self.group
        self.adam.zero_grad()
        total = torch.zeros(())
        if mine.start < mine.stop:
            weight = (mine.stop - mine.start) / len(chosen)
            loss = self.objective.loss(chosen, random, mine)
            (loss if group.count == 1 else weight * loss).backward()
            total = weight * loss.detach().cpu()
        if group.count > 1:
            for parameter in self.parameters:
                parameter.grad = torch.zeros_like(parameter) if parameter.grad is None else parameter.grad
            group.sum_in_place([total, *(p.grad for p in self.parameters if p.grad is not None)])
        return float(total)

    def _agree(self) -> None:
        """Copies the state of the first process to all others, since machines may round differently."""
        if self.group.count == 1:
            return
        from safetensors.numpy import load

        arrays, metadata = self._state()
        sent = (
            self.group.broadcast_from_first(tensor_bytes(arrays, {})),
            self.group.broadcast_from_first(json.dumps(metadata).encode()),
        )
        if not self.group.first:
            self._take(load(sent[0]), json.loads(sent[1]))

    def _remember_best(self) -> None:
        if not self.group.first:
            return
        with torch.no_grad():
            loss = float(self.objective.validation_loss(np.random.default_rng(self.schedule.seed)))
        self.losses.append(loss)
        if loss < self.best_loss:
            self.best_loss = loss
            self.best = [p.detach().clone() for p in self.parameters]

    def _keep(self, checkpoint: Checkpoint) -> None:
        arrays, metadata = self._state()
        write_tensors(checkpoint.path, arrays, metadata | {"mark": checkpoint.mark})
        self._kept_at = time.monotonic()

    def _restore(self, checkpoint: Checkpoint) -> bool:
        """Resumes from a checkpoint of the same training; returns whether there was one.

        A damaged checkpoint is renamed, with a warning, and the training starts again.
        """
        path = checkpoint.path
        if not os.path.lexists(path):
            return False
        try:
            arrays, metadata = read_tensors(path, "training", error=BadModel, damaged=_DamagedCheckpoint)
            if metadata.get("mark") != checkpoint.mark:
                return False
            self._check(arrays, metadata)
        except _DamagedCheckpoint as reason:
            self._put_aside(path, reason)
            return False
        except BadModel as reason:
            cure = f"make it readable, or delete {path}: the training then begins anew"
            raise BadModel(f"the checkpoint {path} cannot be used", reason.got, cure) from reason
        self._take(arrays, metadata)
        return True

    def _put_aside(self, path: Path, reason: BadModel) -> None:
        aside = path.with_name(f"{path.name}.damaged")
        try:
            path.replace(aside)
        except OSError as error:
            cure = f"delete {path}: the training then begins anew"
            raise BadModel(f"the damaged checkpoint {path} cannot be renamed", error.strerror or error, cure) from error
        cure = f"it is kept as {aside.name}, and the training of the {self.objective.name} begins anew"
        warnings.warn(HemlineWarning(f"the checkpoint {path} is damaged", reason.got, cure), stacklevel=2)

    def _check(self, arrays: dict[str, np.ndarray], metadata: dict[str, Any]) -> None:
        """Raises if a checkpoint does not hold what `_state` writes for these parameters."""
        steps, best, done = (metadata.get(name) for name in ("steps", "best", "done"))
        numbers = type(steps) in (int, float) and (best is None or type(best) in (int, float))
        if not isinstance(done, int) or done < 0 or not numbers:
            raise _DamagedCheckpoint("the checkpoint", "numbers that no training has", "begin anew")

        def of(name: str, dtype: str, shape: tuple[int, ...]) -> None:
            array_of(arrays, name, dtype, shape, owner="the checkpoint", error=_DamagedCheckpoint)

        for i, parameter in enumerate(self.parameters):
            moments = f"first{i}" in arrays or f"second{i}" in arrays
            for kind in ("parameter", "best", "first", "second") if moments else ("parameter", "best"):
                # a single number is written as an array of one
                of(f"{kind}{i}", parameter.detach().cpu().numpy().dtype.name, tuple(parameter.shape) or (1,))
        for name, count in (("losses", done + 1), ("trained", done)):
            if name in arrays:
                of(name, "float64", (count,))

    def _state(self) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Returns everything that the next epoch depends on."""
        arrays = {f"parameter{i}": p.detach().cpu().numpy() for i, p in enumerate(self.parameters)}
        arrays |= {f"best{i}": p.cpu().numpy() for i, p in enumerate(self.best)}
        steps = 0.0
        for i, parameter in enumerate(self.parameters):
            if moments := self.adam.state.get(parameter):
                first, second = (moments[name].cpu().numpy() for name in ("exp_avg", "exp_avg_sq"))
                arrays |= {f"first{i}": first, f"second{i}": second}
                steps = float(moments["step"])
        best = self.best_loss if math.isfinite(self.best_loss) else None
        arrays |= {"losses": np.array(self.losses), "trained": np.array(self.batch_losses)}
        return arrays, {"kind": "training", "done": self.done, "steps": steps, "best": best}

    def _take(self, arrays: dict[str, np.ndarray], metadata: dict[str, Any]) -> None:
        """Continues from a state."""

        def tensor(name: str, like: torch.Tensor) -> torch.Tensor:
            return torch.from_numpy(arrays[name]).reshape(like.shape).to(like.device)

        with torch.no_grad():
            for i, parameter in enumerate(self.parameters):
                parameter.copy_(tensor(f"parameter{i}", parameter))
                if metadata["steps"] and f"first{i}" in arrays:
                    self.adam.state[parameter] = {
                        "step": torch.tensor(metadata["steps"]),
                        "exp_avg": tensor(f"first{i}", parameter),
                        "exp_avg_sq": tensor(f"second{i}", parameter),
                    }
        self.best = [tensor(f"best{i}", parameter) for i, parameter in enumerate(self.parameters)]
        self.best_loss = math.inf if metadata["best"] is None else metadata["best"]
        self.losses, self.batch_losses = (
            arrays[name].tolist() if name in arrays else [] for name in ("losses", "trained")
        )
        self.done = int(metadata["done"])
