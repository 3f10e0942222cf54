"""The training of the estimator in stages. After a kill it continues to the same bits."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import torch

from hemline.animators.swingar.estimator_config import EstimatorConfig
from hemline.compiled import use_threads
from hemline.errors import BadDataset
from hemline.learning.fit.device import usable_device
from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer
from hemline.options import check_options, fraction, not_negative, positive

from .estimator import Estimator
from .frame_reader import FrameReader
from .losses import LossWeights
from .objectives import SUPERVISED, CoarseObjective, CorrectiveObjective, Groups
from .samples import TrainingSamples

STAGES = ("coarse", "coarse-all-terms", "corrective")
"""Stages in their order; the second one continues from the first with all terms of the loss."""
TERM_RATE = 0.1
"""Learning rate of the second stage, relative to the others: it refines weights that have been annealed."""


@dataclass(frozen=True)
class TrainingPlan:
    """Length and speed of the training."""

    coarse_epochs: int = not_negative(200)
    """Epochs of the coarse predictor with the vertex term."""
    term_epochs: int = not_negative(50)
    """Further epochs of the coarse predictor with all terms."""
    corrective_epochs: int = not_negative(100)
    """Epochs of the corrective predictor with all terms."""
    patience: int = not_negative(50)
    """Number of epochs after which the first stage ends if its error fell by less than 2 %; 0 never ends it early."""
    frames: int = positive(8)
    """Number of frames of one garment in a batch."""
    garments: int = positive(2)
    """Number of garments in a batch."""
    epoch: int = positive(100)
    """Number of such groups of frames in an epoch."""
    validation: int = positive(12)
    """Number of frames of each held-out garment that are validated after an epoch."""
    mirrored: bool = True
    """Whether half of the groups are mirrored."""
    evenness: float = not_negative(0.5)
    """Exponent that balances garments: the loss of a garment is divided by its skinning error to this power."""
    unknown: float = fraction(0.2)
    """Fraction of the groups whose features hide how the garment lay at the beginning."""
    rate: float = positive(1e-3)
    """Initial learning rate of Adam; that of the second stage is `TERM_RATE` times as large."""
    warm_up: int = not_negative(200)
    """Number of steps over which the learning rate rises."""
    clip: float = positive(1.0)
    """Norm at which gradients are clipped."""
    checkpoint_seconds: float = not_negative(120.0)
    """Time between checkpoints [s]."""
    threads: int = positive(1)
    """Number of threads of torch and of the kernels of the layers."""
    device: str = "cpu"
    """Device to train on, as torch names it: `cpu` or `cuda`."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def groups(self) -> Groups:
        """How samples are drawn."""
        return Groups(
            self.frames,
            self.epoch,
            self.validation,
            mirrored=self.mirrored,
            evenness=self.evenness,
            unknown=self.unknown,
        )


@dataclass(frozen=True)
class Trained:
    """The result of a training."""

    arrays: dict[str, np.ndarray]
    """Weights by name, float32; see `estimator_config.weight_shapes`."""
    curves: dict[str, list[float]] = field(default_factory=dict)
    """Validation loss at the start of each stage and after each of its epochs [m]: the mean distance, and in the stages
    with all terms the others, weighted relative to it."""
    coarse_error: float = math.inf
    """Mean distance of held-out vertices without the corrective displacement [m]."""
    error: float = math.inf
    """Mean distance of held-out vertices as they are played [m]."""
    corrective_admitted: bool = False
    """Whether the corrective predictor lowered the error on held-out samples. If it did not, its output is zero."""


def train_estimator(
    samples: TrainingSamples,
    config: EstimatorConfig,
    plan: TrainingPlan,
    *,
    seed: int,
    mark: str,
    folder: Path | None,
    progress: Callable[[str, int, int], None],
    start: dict[str, np.ndarray] | None = None,
    weights: LossWeights | None = None,
    scales: tuple[np.ndarray, np.ndarray] | None = None,
) -> Trained:
    """Trains the coarse predictor, then the corrective one on the meshes of the first.

    Args:
        samples: The training set.
        config: Sizes of the estimator.
        plan: Length and speed of the training.
        seed: Seed of the weights and of everything that is drawn.
        mark: Hash of everything that the training depends on; a checkpoint with another one is not used.
        folder: Folder for checkpoints, one file for each stage; None keeps none.
        progress: Called with the stage, the epochs done and the number of epochs; its exceptions stop the training.
        start: Weights to continue from (fine-tuning); None draws them.
        weights: Weights of the loss terms; None uses those of `LossWeights`.
        scales: Mean and spread of the features of vertices (features,); None uses 0 and 1. `start` overrides them.

    Raises:
        BadDataset: The training set or the validation set is empty.
        BadInput: There is no such device.
        BadModel: The loss is not finite, or a checkpoint cannot be read.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section IV. Differs: in stages, on sparse frames that do not depend
        on each other; the corrective predictor is admitted only where it lowers the error on held-out samples.
    """
    for name in ("training", "validation"):
        if len(getattr(samples, name)) == 0:
            raise BadDataset(f"the {name} set of the estimator is empty", "no samples", "give it more clips")
    use_threads(plan.threads)
    torch.manual_seed(seed)
    device = usable_device(plan.device)
    if device.type == "cuda":
        torch.set_float32_matmul_precision("high")  # TF32, several times as fast
    estimator, weights, curves = Estimator(config).to(device), weights or LossWeights(), {}
    if scales is not None and config.told:
        estimator.told_mean.copy_(torch.from_numpy(scales[0]))
        estimator.told_spread.copy_(torch.from_numpy(scales[1]))
    if start is not None:
        estimator.load_state_dict({name: torch.from_numpy(each) for name, each in start.items()})

    def train(stage: str, objective: CoarseObjective | CorrectiveObjective, epochs: int, patience: int = 0) -> None:
        rate = plan.rate * (TERM_RATE if stage == STAGES[1] else 1.0)
        schedule = Schedule(epochs, plan.garments, rate, seed, plan.threads, plan.warm_up, plan.clip, patience=patience)
        trainer = Trainer(objective, schedule)
        checkpoint = None
        if folder:
            checkpoint = Checkpoint(folder / f"{stage}.safetensors", mark, 1, seconds=plan.checkpoint_seconds)
        trainer.run(checkpoint=checkpoint, progress=lambda done, total: progress(stage, done, total))
        curves[stage] = trainer.losses

    reader = FrameReader(samples, device)
    coarse = CoarseObjective(estimator, samples, plan.groups, SUPERVISED, reader)
    train(STAGES[0], coarse, plan.coarse_epochs, plan.patience)
    if plan.term_epochs:
        train(STAGES[1], CoarseObjective(estimator, samples, plan.groups, weights, reader), plan.term_epochs)
    coarse_error = error = float(np.mean(coarse.errors()))
    admitted = False
    if plan.corrective_epochs:
        corrective = CorrectiveObjective(estimator, samples, plan.groups, weights, reader)
        train(STAGES[2], corrective, plan.corrective_epochs)
        corrective_error = float(np.mean(corrective.errors()))
        admitted = corrective_error < coarse_error
        error = min(corrective_error, coarse_error)
    if not admitted:
        with torch.no_grad():
            estimator.corrective_scale.zero_()
    arrays = {name: each.cpu().numpy().copy() for name, each in estimator.state_dict().items()}
    return Trained(arrays, curves, coarse_error, error, admitted)
