"""Trains a neural distance on points around posed bodies, as an objective of `Trainer`."""

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

from .samples import DistanceSamples, in_pelvis_frame


@dataclass(frozen=True)
class SdfConfig:
    """Options of the training of a neural distance."""

    inputs: Inputs = "bones"
    """Inputs of a point: its coordinates in the frames of bones, or `point` as in the paper."""
    width: int = positive(128)
    """Number of neurons of a hidden layer; the paper uses 512."""
    updates: int = positive(10_000)
    """Number of optimiser steps, rounded to whole passes over the bodies."""
    bodies: int = positive(24)
    """Number of posed bodies per step."""
    points: int = positive(96)
    """Number of points per body and step."""
    rate: float = positive(2e-3)
    """Initial learning rate."""
    value_weight: float = positive(30.0)
    """Loss weight of the distance [1/m]; the paper uses 1."""
    eikonal_weight: float = positive(0.15)
    """Loss weight of the eikonal term."""
    seed: int = 0
    """Seed of weights, bodies and points."""

    def __post_init__(self) -> None:
        check_options(self)


class SdfObjective:
    """Objective of `Trainer` over points around posed bodies."""

    name = "neural distance"

    def __init__(
        self, body: Body, train: Sequence[DistanceSamples], held_out: Sequence[DistanceSamples], config: SdfConfig
    ):
        """Initialises the network.

        Args:
            body: The body.
            train: Training samples.
            held_out: Samples that select the best epoch.
            config: Options.
        """
        from hemline.learning.fit.distance_network import DistanceNetwork

        self.config = config
        self.train, self.held_out = BodySamples(body, train, config.inputs), BodySamples(body, held_out, config.inputs)
        read = self.train.conditions.shape[1]
        self.network = DistanceNetwork.initialize(config.inputs, width=config.width, condition=read, seed=config.seed)

    @property
    def parameters(self):
        """Weights and biases of the network."""
        return self.network.parameters

    @property
    def samples(self) -> np.ndarray:
        """Indices of the posed bodies."""
        return np.arange(len(self.train.inputs))

    def loss(self, chosen: np.ndarray, random: np.random.Generator, mine: slice):
        """Returns the loss of Eqs. 8 and 9 at random points around the chosen bodies."""
        import torch

        from hemline.learning.fit.distance_network import distance_loss

        batch = self.train.draw_batch(chosen, self.config.points, random, mine, jacobians=True)
        features, jacobians, conditions, truth, normals = (torch.from_numpy(array) for array in batch)
        codes = self.network.code(conditions).repeat_interleave(self.config.points, 0)
        weights = {"value_weight": self.config.value_weight, "eikonal_weight": self.config.eikonal_weight}
        return distance_loss(*self.network.with_gradients(features, jacobians, codes), truth, normals, **weights)

    def validation_loss(self, random: np.random.Generator):
        """Returns the mean distance error at points around held-out bodies [m]."""
        import torch

        every = np.arange(len(self.held_out.inputs))
        batch = self.held_out.draw_batch(every, VALIDATION_POINTS, random, slice(None), jacobians=False)
        features, _, conditions, truth, _ = (torch.from_numpy(array) for array in batch)
        codes = self.network.code(conditions).repeat_interleave(VALIDATION_POINTS, 0)
        return (self.network.distances(features, codes) - truth).abs().mean()


VALIDATION_POINTS = 100
"""Number of points per held-out body for the validation loss."""


class BodySamples:
    """Samples with the network's inputs for each body, in the frame of its pelvis."""

    def __init__(self, body: Body, samples: Sequence[DistanceSamples], inputs: Inputs):
        self.inputs: list[PointInputs] = []
        conditions = []
        for shard in samples:
            for betas, rotations in zip(shard.betas, shard.rotations, strict=True):
                shaped = body.shaped(betas)
                transforms = shaped.transforms_of(*_single_frame(in_pelvis_frame(shaped, rotations)))[0][0]
                self.inputs.append(PointInputs(inputs, invert_transforms(transforms), BoneCapsules.of(shaped)))
                conditions.append(condition(betas, rotations))
        self.conditions = np.stack(conditions)
        self.points = np.concatenate([shard.points for shard in samples])
        self.distances = np.concatenate([shard.distances for shard in samples])
        self.gradients = np.concatenate([shard.gradients for shard in samples])

    def draw_batch(
        self, bodies: np.ndarray, count: int, random: np.random.Generator, mine: slice, *, jacobians: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Returns features, their derivatives, conditions, distances and gradients at random points of `bodies[mine]`.

        Random points are drawn for all of `bodies`, so that a process draws the same ones for its part.
        """
        points_of_all = random.integers(self.points.shape[1], size=(len(bodies), count))
        bodies = bodies[mine]
        rows = bodies[:, None], points_of_all[mine]
        parts = [
            self.inputs[body].features(points, jacobians=jacobians)
            for body, points in zip(bodies, self.points[rows], strict=True)
        ]
        features, derivatives = (np.concatenate(column) for column in zip(*parts, strict=True))
        truth, normals = self.distances[rows].reshape(-1), self.gradients[rows].reshape(-1, 3).astype(np.float32)
        return features, derivatives, self.conditions[bodies], truth, normals


def train_sdf(
    body: Body,
    train: Sequence[DistanceSamples],
    held_out: Sequence[DistanceSamples],
    config: SdfConfig,
    *,
    checkpoint: Path | None = None,
    progress: Callable[[int, int], None] = lambda *_: None,
) -> NeuralSdf:
    """Trains a neural distance; a killed training continues from its checkpoint.

    Args:
        body: The body.
        train: Training samples.
        held_out: Samples of other subjects, which select the best epoch.
        config: Options.
        checkpoint: Checkpoint file; None for no checkpoints.
        progress: Called with the epochs done and the total number of epochs.

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
    return objective.network.to_neural_sdf((body.name, body.hash), (-largest, largest), figures)


def _single_frame(pose) -> tuple[np.ndarray, np.ndarray]:
    return pose.rotations[None], pose.translation[None]
