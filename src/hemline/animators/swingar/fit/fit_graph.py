"""The fit of the graph network."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.animators.swingar.config import SwingarConfig
from hemline.animators.swingar.estimator_config import JOINTS, EstimatorConfig
from hemline.animators.swingar.graph_inputs import STATE_TOLD, TOLD
from hemline.animators.swingar.graph_network import GraphNetwork
from hemline.animators.swingar.runtime import RuntimeEstimator

from .graph_samples import TakeSamples

DISPLACEMENT = 128
"""Width of the layers that displace vertices."""


def fit_graph(
    frames: SplitFrames,
    config: SwingarConfig,
    *,
    start: GraphNetwork | None,
    seed: int,
    mark: str,
    checkpoints: Path | None,
    tell: Callable[[str, int, int], None],
) -> tuple[GraphNetwork, dict[str, float]]:
    """Learn; arguments as `fit_lag.fit_lag`.

    Returns:
        The network, and its error on takes that are not learned from, mean distance of proxy vertices.

    Raises:
        BadModel: The training diverged.
    """
    from .objectives import validation_frames
    from .train_estimator import TrainingPlan, train_estimator

    betas = frames.groups[0].body.shape[1] - 3 * JOINTS
    estimator = estimator_of(config, betas) if start is None else start.estimator.config
    samples = samples_of(frames, estimator.descriptor)
    plan = TrainingPlan(
        coarse_epochs=config.epochs,
        term_epochs=config.term_epochs,
        corrective_epochs=config.corrective_epochs,
        epoch=config.groups,
        frames=config.frames,
        garments=config.garments,
        rate=config.rate,
        threads=config.threads,
        device=config.device,
        mirrored=config.mirrored,
        evenness=config.evenness,
        unknown=config.unknown,
    )
    trained = train_estimator(
        samples,
        estimator,
        plan,
        seed=seed,
        mark=mark,
        folder=checkpoints,
        progress=lambda *done: tell(*done),
        start=None if start is None else dict(start.estimator.arrays),
        scales=samples.scales(),
    )
    skinned = [samples.skinned(chosen) for chosen in validation_frames(samples, plan.groups)]
    figures = {
        "frames": float(len(samples.training)),
        "held_out_mm": 1e3 * trained.error,
        "held_out_skinned_mm": 1e3 * float(np.mean(skinned)),
        "held_out_coarse_mm": 1e3 * trained.coarse_error,
        "corrective_admitted": float(trained.corrective_admitted),
    }
    return GraphNetwork(RuntimeEstimator.of(estimator, trained.arrays, dtype="float32")), figures


def estimator_of(config: SwingarConfig, betas: int) -> EstimatorConfig:
    """The sizes that options ask for.

    Args:
        config: The options.
        betas: Shape coefficients of the body.
    """
    made = EstimatorConfig.lean() if config.sizes == "lean" else EstimatorConfig()
    own = {"told": TOLD, "state_told": STATE_TOLD, "displacement": DISPLACEMENT} if config.features else {}
    return replace(made, body=betas + 3 * JOINTS, alpha=config.alpha, **own)


def samples_of(frames: SplitFrames, descriptor: int) -> TakeSamples:
    """Frames of takes as samples.

    Args:
        frames: The frames, and what they are for.
        descriptor: Numbers of the spectral descriptor.
    """
    return TakeSamples.of(frames.groups, [each == "train" for each in frames.splits], descriptor)
