"""Training of one network with torch: coefficients from bones, on the data term and the collision term."""

import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import torch

from hemline.errors import BadModel
from hemline.files import read_tensors, write_tensors

from .collision import missing
from .config import RopesConfig
from .lesson import Contact, Lesson
from .linear_start import as_network, ridge
from .mlp import Mlp

SMALLEST_DEVIATION = 0.005
"""Inputs that hardly move are divided by at least this, so that they are not blown up [m]."""


def train_network(
    lesson: Lesson,
    contact: Contact | None,
    config: RopesConfig,
    *,
    rate: float,
    seed: int,
    mark: str,
    progress: Callable[[int, int], None],
    folder: Path | None,
) -> Mlp:
    r"""Fit a network of two hidden layers.

    The data term is the mean square distance of the vertices. With an orthonormal basis it is, up to a constant, that
    of the coefficients: $\sum_k (c_k - c^*_k)^2 / V$, which costs a hundredth.

    Args:
        lesson: Inputs, outputs and the split.
        contact: For the collision term; None leaves it out.
        config: Options.
        rate: First learning rate of Adam; a cosine takes it to zero.
        seed: Seed of the weights, of the order of frames and of the noise.
        mark: Hash of all that the training depends on; a checkpoint with another one is not used.
        progress: Called with the passes done and in all.
        folder: Where the checkpoint is kept; None: nowhere.

    Returns:
        The network, with the scales of inputs and outputs folded in.

    Raises:
        BadModel: The loss is no longer finite.

    Source: Jin et al., "Rope chains", 2024, Sections 7 to 9. Differs: inputs and outputs are scaled to unit deviation;
        the network begins as the ridge regression (`linear_start`), without which a thousand frames leave five times
        the error on unseen clips and the paper's rates hardly get anywhere; noise on the bones; the pass with the
        least validation loss is kept.
    """
    trainer = _Trainer(lesson, contact, config, rate, seed)
    total = config.epochs
    checkpoint = folder / f"{lesson.stage}.safetensors" if folder else None
    done = trainer.restore(checkpoint, mark) if checkpoint else 0
    while done < total:
        trainer.set_rate(0.5 * rate * (1 + math.cos(math.pi * done / total)))
        trainer.run_epoch(done)
        done += 1
        trainer.remember_best()
        if checkpoint and (done % config.checkpoint_epochs == 0 or done == total):
            trainer.keep(checkpoint, mark, done)
        progress(done, total)
    trainer.return_to_best()
    return trainer.network()


class _Trainer:
    def __init__(self, lesson: Lesson, contact: Contact | None, config: RopesConfig, rate: float, seed: int):
        torch.set_num_threads(config.threads)
        self.lesson, self.contact, self.config, self.seed = lesson, contact, config, seed
        trained = lesson.bones[lesson.train]
        self.mean = trained.mean(axis=0)
        self.spread = np.maximum(trained.std(axis=0), SMALLEST_DEVIATION).astype(np.float32)
        self.deviations = np.maximum(lesson.deviations, 1e-6).astype(np.float32)
        generator = torch.Generator().manual_seed(seed)
        sizes = (lesson.bones.shape[1], config.hidden, config.hidden, lesson.coefficients.shape[1])
        self.layers = drawn_layers(sizes, generator)
        self.start_linear()
        self.parameters = [p for layer in self.layers for p in layer]
        self.adam = torch.optim.Adam(self.parameters, lr=rate)
        self.scale = torch.from_numpy(self.deviations)
        self.best = [p.detach().clone() for p in self.parameters]
        self.best_loss = math.inf
        self.remember_best()

    def start_linear(self) -> None:
        """Begin as the linear map that is best on bones with noise: a small set of frames already determines it."""
        lesson = self.lesson
        noise = np.where(lesson.free > 0, self.config.bone_noise, SMALLEST_DEVIATION) / self.spread
        outputs = lesson.coefficients[lesson.train] / self.deviations
        matrix, offset = ridge(self.scaled(lesson.bones[lesson.train]), outputs, noise, np.ones(len(lesson.train)))
        as_network(matrix, offset, [(w.detach().numpy(), b.detach().numpy()) for w, b in self.layers])

    def scaled(self, bones: np.ndarray) -> np.ndarray:
        return (bones - self.mean) / self.spread

    def set_rate(self, rate: float) -> None:
        for group in self.adam.param_groups:
            group["lr"] = rate

    def coefficients(self, bones: torch.Tensor) -> torch.Tensor:
        value = (bones - torch.from_numpy(self.mean)) / torch.from_numpy(self.spread)
        for i, (weight, bias) in enumerate(self.layers):
            value = torch.nn.functional.linear(value, weight, bias)
            value = torch.relu(value) if i < len(self.layers) - 1 else value
        return value * self.scale

    def run_epoch(self, epoch: int) -> None:
        # a generator of its own for each pass: a training that was resumed goes the same way
        random = np.random.default_rng((self.seed, epoch))
        order = random.permutation(self.lesson.train)
        for first in range(0, len(order), self.config.batch):
            loss = self.loss(np.sort(order[first : first + self.config.batch]), random)
            self.adam.zero_grad()
            loss.backward()
            self.adam.step()
        if not math.isfinite(float(loss.detach())):
            raise BadModel(
                f"the training of the {self.lesson.stage} network diverged",
                "a loss that is not finite",
                "lower its learning rate",
            )

    def loss(self, chosen: np.ndarray, random: np.random.Generator) -> torch.Tensor:
        bones = self.lesson.bones[chosen]
        noise = random.standard_normal(bones.shape, np.float32) * np.float32(self.config.bone_noise)
        return self.both_terms(chosen, self.coefficients(torch.from_numpy(bones + noise * self.lesson.free)), random)

    def both_terms(self, chosen: np.ndarray, found: torch.Tensor, random: np.random.Generator) -> torch.Tensor:
        loss = self.config.data_weight * self.misses(chosen, found).mean() / self.lesson.vertex_count
        if self.contact:
            loss = loss + self.config.collision_weight * self.collision(chosen, found, random)
        return loss

    def misses(self, chosen: np.ndarray, found: torch.Tensor) -> torch.Tensor:
        """Square distance of the coefficients of each frame to what they should be."""
        return ((found - torch.from_numpy(self.lesson.coefficients[chosen])) ** 2).sum(dim=1)

    def collision(self, chosen: np.ndarray, found: torch.Tensor, random: np.random.Generator) -> torch.Tensor:
        """Mean over random vertices of the square of what they lack; unbiased in the choice."""
        assert self.contact is not None
        count = min(self.config.collision_vertices, self.lesson.vertex_count)
        vertices = np.sort(random.choice(self.lesson.vertex_count, count, replace=False))
        rows = (3 * vertices[:, None] + np.arange(3)).reshape(-1)
        offsets = found @ torch.from_numpy(self.contact.basis[:, rows])
        if self.contact.before is not None:  # torch's product: NumPy's threads would wait for torch's, and they for it
            coefficients, basis = self.contact.before
            offsets = offsets + torch.from_numpy(coefficients[chosen]) @ torch.from_numpy(basis[:, rows])
        truth = torch.from_numpy(self.contact.displacements[chosen[:, None], rows])
        offsets = (offsets - truth).reshape(len(chosen), count, 3)
        normals, heights = (torch.from_numpy(each) for each in self.contact.clearances.rows(chosen, vertices))
        return (missing(offsets, normals, heights, self.config.expansion) ** 2).mean()

    def remember_best(self) -> None:
        loss = self.validation_loss()
        if loss < self.best_loss:
            self.best_loss = loss
            self.best = [p.detach().clone() for p in self.parameters]

    def validation_loss(self) -> float:
        """The loss on held-out frames, without noise and on the same vertices every time."""
        frames = self.lesson.val if len(self.lesson.val) else self.lesson.train
        with torch.no_grad():
            found = self.coefficients(torch.from_numpy(self.lesson.bones[frames]))
            return float(self.both_terms(frames, found, np.random.default_rng(self.seed)))

    def return_to_best(self) -> None:
        with torch.no_grad():
            for parameter, best in zip(self.parameters, self.best, strict=True):
                parameter.copy_(best)

    def network(self) -> Mlp:
        return folded(self.layers, self.mean, self.spread, self.deviations)

    def keep(self, path: Path, mark: str, done: int) -> None:
        arrays = {f"parameter{i}": p.detach().numpy() for i, p in enumerate(self.parameters)}
        arrays |= {f"best{i}": p.numpy() for i, p in enumerate(self.best)}
        for i, parameter in enumerate(self.parameters):
            moments = self.adam.state[parameter]
            arrays |= {f"first{i}": moments["exp_avg"].numpy(), f"second{i}": moments["exp_avg_sq"].numpy()}
        steps = float(self.adam.state[self.parameters[0]]["step"])
        best = self.best_loss if math.isfinite(self.best_loss) else None
        write_tensors(path, arrays, {"kind": "training", "mark": mark, "done": done, "steps": steps, "best": best})

    def restore(self, path: Path, mark: str) -> int:
        """Go on from a checkpoint of the same training; the passes done, 0 without one."""
        if not path.exists():
            return 0
        arrays, metadata = read_tensors(path, "training", error=BadModel)
        if metadata.get("mark") != mark:
            return 0
        with torch.no_grad():
            for i, parameter in enumerate(self.parameters):
                parameter.copy_(torch.from_numpy(arrays[f"parameter{i}"]))
                self.adam.state[parameter] = {
                    "step": torch.tensor(metadata["steps"]),
                    "exp_avg": torch.from_numpy(arrays[f"first{i}"]),
                    "exp_avg_sq": torch.from_numpy(arrays[f"second{i}"]),
                }
        self.best = [torch.from_numpy(arrays[f"best{i}"]) for i in range(len(self.parameters))]
        self.best_loss = math.inf if metadata["best"] is None else metadata["best"]
        return int(metadata["done"])


def drawn_layers(sizes: Sequence[int], generator: torch.Generator) -> list[tuple[torch.Tensor, torch.Tensor]]:
    """Weights drawn evenly within +-sqrt(6 / ins) (He et al. 2015), biases zero."""
    layers = []
    for ins, outs in itertools.pairwise(sizes):
        weight = (torch.rand((outs, ins), generator=generator) * 2 - 1) * math.sqrt(6 / ins)
        layers.append((weight.requires_grad_(), torch.zeros(outs).requires_grad_()))
    return layers


def folded(
    layers: list[tuple[torch.Tensor, torch.Tensor]], mean: np.ndarray, spread: np.ndarray, scale: np.ndarray
) -> Mlp:
    """A network of (x - mean) / spread whose outputs are multiplied by scale, as one of x."""
    weights = [layer[0].detach().numpy().astype(np.float64) for layer in layers]
    biases = [layer[1].detach().numpy().astype(np.float64) for layer in layers]
    biases[0] = biases[0] - weights[0] @ (mean / spread)
    weights[0] = weights[0] / spread
    weights[-1] = weights[-1] * scale[:, None]
    biases[-1] = biases[-1] * scale
    return Mlp.rounded(weights, biases)
