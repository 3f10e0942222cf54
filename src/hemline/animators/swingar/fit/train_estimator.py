"""Training of the estimator in stages, resumed to the same bits after a kill."""

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
from hemline.options import check_options, not_negative, positive, share

from .estimator import Estimator
from .losses import LossWeights
from .objectives import SUPERVISED, CoarseObjective, CorrectiveObjective, Groups
from .samples import Samples

STAGES = ("coarse", "coarse-all-terms", "corrective")
"""In this order; the second goes on from the first with all terms of the loss."""


@dataclass(frozen=True)
class TrainingPlan:
    """How long and how fast the estimator is trained."""

    coarse_epochs: int = not_negative(200)
    """Epochs of the coarse predictor on the vertex term."""
    term_epochs: int = not_negative(50)
    """Epochs of it on all terms."""
    corrective_epochs: int = not_negative(100)
    """Epochs of the corrective predictor, on all terms."""
    patience: int = not_negative(50)
    """The first stage ends once the error fell by less than 2 % in so many epochs; 0: never before its end."""
    frames: int = positive(8)
    """Frames of one garment in a batch."""
    garments: int = positive(2)
    """Garments in a batch."""
    epoch: int = positive(100)
    """Groups of such frames in an epoch."""
    validation: int = positive(12)
    """Frames of each held-out garment that are looked at after an epoch."""
    mirrored: bool = True
    """Whether half of the groups are shown with left and right exchanged."""
    evenness: float = not_negative(0.5)
    """Garments count by what skinning misses of them to minus this power."""
    unknown: float = share(0.2)
    """Share of the groups that are shown without how the garment lay at the beginning."""
    rate: float = positive(1e-3)
    """First learning rate of Adam."""
    warm_up: int = not_negative(200)
    """Steps over which it rises."""
    clip: float = positive(1.0)
    """Longest gradient."""
    checkpoint_seconds: float = not_negative(120.0)
    """Time between checkpoints [s]."""
    threads: int = positive(1)
    """Threads of torch and of the layers' kernels."""
    device: str = "cpu"
    """Where it is trained, as torch names it: `cpu`, or `cuda`."""

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
    """What came of a training."""

    arrays: dict[str, np.ndarray]
    """Weights by name, float32; see `estimator_config.weight_shapes`."""
    curves: dict[str, list[float]] = field(default_factory=dict)
    """Validation error at the start of each stage and after each of its epochs [m]."""
    coarse_error: float = math.inf
    """Mean distance of held-out vertices of the coarse mesh [m]."""
    error: float = math.inf
    """The same of what is played [m]."""
    corrective_admitted: bool = False
    """Whether the corrective predictor beat the coarse mesh on held-out samples; if not, its output is zero."""


def train_estimator(
    samples: Samples,
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
    """Train the coarse predictor, then the corrective one on what the first makes.

    Args:
        samples: The training set.
        config: Sizes of the estimator.
        plan: How long and how fast.
        seed: Seed of the weights and of all that is drawn.
        mark: Hash of all that the training depends on; a checkpoint with another one is not used.
        folder: Where checkpoints are kept, one file a stage; None: nowhere.
        progress: Called with the stage, epochs done and in all; what it raises stops the training.
        start: Weights to go on from (fine-tuning); None: drawn.
        weights: Of the terms of the loss; None: the paper's.
        scales: Mean and spread of the features of vertices (told,); None: 0 and 1. Those of `start` count where there
            is one.

    Raises:
        BadDataset: There is nothing to train on, or nothing to choose the best weights by.
        BadInput: There is no such device here.
        BadModel: The loss is no longer finite, or a checkpoint cannot be read.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section IV. Differs: in stages, on sparse frames that do not depend
        on each other; the corrective predictor is admitted only where it lowers the error on held-out samples.
    """
    for name in ("training", "validation"):
        if len(getattr(samples, name)) == 0:
            raise BadDataset(f"the {name} set of the estimator is empty", "no samples", "give it more clips")
    use_threads(plan.threads)
    torch.manual_seed(seed)
    estimator, weights, curves = Estimator(config).to(usable_device(plan.device)), weights or LossWeights(), {}
    if scales is not None and config.told:
        estimator.told_mean.copy_(torch.from_numpy(scales[0]))
        estimator.told_spread.copy_(torch.from_numpy(scales[1]))
    if start is not None:
        estimator.load_state_dict({name: torch.from_numpy(each) for name, each in start.items()})

    def train(stage: str, objective: CoarseObjective | CorrectiveObjective, epochs: int, patience: int = 0) -> None:
        schedule = Schedule(
            epochs, plan.garments, plan.rate, seed, plan.threads, plan.warm_up, plan.clip, patience=patience
        )
        trainer = Trainer(objective, schedule)
        checkpoint = None
        if folder:
            checkpoint = Checkpoint(folder / f"{stage}.safetensors", mark, 1, seconds=plan.checkpoint_seconds)
        trainer.run(checkpoint=checkpoint, progress=lambda done, total: progress(stage, done, total))
        curves[stage] = trainer.losses

    coarse = CoarseObjective(estimator, samples, plan.groups, SUPERVISED)
    train(STAGES[0], coarse, plan.coarse_epochs, plan.patience)
    if plan.term_epochs:
        train(STAGES[1], CoarseObjective(estimator, samples, plan.groups, weights), plan.term_epochs)
    coarse_error = error = float(np.mean(coarse.errors()))
    admitted = False
    if plan.corrective_epochs:
        corrective = CorrectiveObjective(estimator, samples, plan.groups, weights)
        train(STAGES[2], corrective, plan.corrective_epochs)
        with_it = float(np.mean(corrective.errors()))
        admitted = with_it < coarse_error
        error = min(with_it, coarse_error)
    if not admitted:
        with torch.no_grad():
            estimator.corrective_scale.zero_()
    arrays = {name: each.cpu().numpy().copy() for name, each in estimator.state_dict().items()}
    return Trained(arrays, curves, coarse_error, error, admitted)
