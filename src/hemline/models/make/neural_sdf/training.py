"""The training of a neural distance: what `Trainer` asks of it, over posed bodies and points around them."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hemline.bodies import Body
from hemline.collide.neural_sdf.capsules import BoneCapsules
from hemline.collide.neural_sdf.inputs import Inputs, PointInputs, condition, invert_transforms
from hemline.collide.neural_sdf.neural_sdf import NeuralSdf
from hemline.files import content_hash
from hemline.options import check_options, positive

from .samples import Samples, in_pelvis_frame


@dataclass(frozen=True)
class SdfConfig:
    """Options of the training."""

    inputs: Inputs = "bones"
    """What is read of a point: `bones`, or `point` as in the paper."""
    width: int = positive(128)
    """Neurons in a hidden layer; 512 in the paper."""
    updates: int = positive(10_000)
    """Steps of the optimiser, rounded to whole passes over the bodies."""
    bodies: int = positive(24)
    """Posed bodies a step."""
    points: int = positive(96)
    """Points a body and step."""
    rate: float = positive(2e-3)
    """First learning rate."""
    value_weight: float = positive(30.0)
    """Weight of the distance in the loss [1/m]; 1 in the paper."""
    eikonal_weight: float = positive(0.15)
    """Weight of the eikonal term."""
    seed: int = 0
    """Seed of all that is drawn."""

    def __post_init__(self) -> None:
        check_options(self)


class SdfObjective:
    """Points around posed bodies: an `Objective`."""

    name = "neural distance"

    def __init__(self, body: Body, train: Sequence[Samples], held_out: Sequence[Samples], config: SdfConfig):
        """Draw the network.

        Args:
            body: The body.
            train: What is learned from.
            held_out: What says which epoch is best.
            config: Options.
        """
        from hemline.learning.fit.distance_network import DistanceNetwork

        self.config = config
        self.train, self.held_out = Around(body, train, config.inputs), Around(body, held_out, config.inputs)
        read = self.train.conditions.shape[1]
        self.network = DistanceNetwork.drawn(config.inputs, width=config.width, condition=read, seed=config.seed)

    @property
    def parameters(self):
        """Weights and biases."""
        return self.network.parameters

    @property
    def samples(self) -> np.ndarray:
        """Numbers of the posed bodies."""
        return np.arange(len(self.train.inputs))

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice):
        """Eqs. 8 and 9 at random points around the chosen bodies."""
        import torch

        from hemline.learning.fit.distance_network import distance_loss

        drawn = self.train.drawn(chosen, self.config.points, random, mine, jacobians=True)
        features, jacobians, conditions, truth, normals = (torch.from_numpy(each) for each in drawn)
        codes = self.network.code(conditions).repeat_interleave(self.config.points, 0)
        weights = {"value_weight": self.config.value_weight, "eikonal_weight": self.config.eikonal_weight}
        return distance_loss(*self.network.with_gradients(features, jacobians, codes), truth, normals, **weights)

    def validation_loss(self, random: np.random.Generator):
        """Mean error of the distance at points around held-out bodies [m]."""
        import torch

        every = np.arange(len(self.held_out.inputs))
        drawn = self.held_out.drawn(every, VALIDATION_POINTS, random, slice(None), jacobians=False)
        features, _, conditions, truth, _ = (torch.from_numpy(each) for each in drawn)
        codes = self.network.code(conditions).repeat_interleave(VALIDATION_POINTS, 0)
        return (self.network.distances(features, codes) - truth).abs().mean()


VALIDATION_POINTS = 100
"""Points a held-out body at which an epoch is judged."""


class Around:
    """Samples with what the network reads of each body, in the frame of its pelvis."""

    def __init__(self, body: Body, samples: Sequence[Samples], inputs: Inputs):
        self.inputs: list[PointInputs] = []
        conditions = []
        for shard in samples:
            for betas, rotations in zip(shard.betas, shard.rotations, strict=True):
                shaped = body.shaped(betas)
                transforms = shaped.transforms_of(*_one(in_pelvis_frame(shaped, rotations)))[0][0]
                self.inputs.append(PointInputs(inputs, invert_transforms(transforms), BoneCapsules.of(shaped)))
                conditions.append(condition(betas, rotations))
        self.conditions = np.stack(conditions)
        self.points = np.concatenate([shard.points for shard in samples])
        self.distances = np.concatenate([shard.distances for shard in samples])
        self.gradients = np.concatenate([shard.gradients for shard in samples])

    def drawn(
        self, bodies: np.ndarray, count: int, random: np.random.Generator, mine: slice, *, jacobians: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Features and their derivatives at some points of `bodies[mine]`, conditions, distances, gradients.

        Points are drawn for all of `bodies`.
        """
        points_of_all = random.integers(self.points.shape[1], size=(len(bodies), count))
        bodies = bodies[mine]
        at = bodies[:, None], points_of_all[mine]
        each = [
            self.inputs[body].features(points, jacobians=jacobians)
            for body, points in zip(bodies, self.points[at], strict=True)
        ]
        features, derivatives = (np.concatenate(column) for column in zip(*each, strict=True))
        truth, normals = self.distances[at].reshape(-1), self.gradients[at].reshape(-1, 3).astype(np.float32)
        return features, derivatives, self.conditions[bodies], truth, normals


def trained(
    body: Body,
    train: Sequence[Samples],
    held_out: Sequence[Samples],
    config: SdfConfig,
    *,
    checkpoint: Path | None = None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> NeuralSdf:
    """Train a neural distance; a killed training goes on from its checkpoint.

    Args:
        body: The body.
        train: What is learned from.
        held_out: What says which epoch is best, of other subjects.
        config: Options.
        checkpoint: Where the training is kept; None: nowhere.
        progress: Called with the epochs done and in all.

    Raises:
        BadModel: The training diverged, or the checkpoint cannot be read.
    """
    from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer

    objective = SdfObjective(body, train, held_out, config)
    epochs = max(1, round(config.updates * config.bodies / len(objective.samples)))
    schedule = Schedule(epochs, config.bodies, config.rate, config.seed, 1)
    mark = content_hash(body.hash, asdict(config), *(shard.distances for shard in (*train, *held_out)))
    trainer = Trainer(objective, schedule)
    trainer.run(checkpoint=None if checkpoint is None else Checkpoint(checkpoint, mark, 1), progress=progress)
    largest = float(max(np.abs(shard.betas).max() for shard in train))
    figures = {
        "bodies": len(objective.samples),
        "points_a_body": int(train[0].points.shape[1]),
        "updates": epochs * -(-len(objective.samples) // config.bodies),
        "held_out_mm": 1000 * trainer.best_loss,
    }
    return objective.network.rounded((body.name, body.hash), (-largest, largest), figures)


def _one(pose) -> tuple[np.ndarray, np.ndarray]:
    return pose.rotations[None], pose.translation[None]
