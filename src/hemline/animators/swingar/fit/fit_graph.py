"""The fit of the graph network."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.animators.swingar.config import SwingarConfig
from hemline.animators.swingar.estimator_config import JOINTS, EstimatorConfig
from hemline.animators.swingar.graph_inputs import STATE_FEATURES, VERTEX
from hemline.animators.swingar.graph_network import GraphNetwork
from hemline.animators.swingar.runtime import RuntimeEstimator

from .graph_samples import TakeSamples

DISPLACEMENT_WIDTH = 256
"""Width of the layers that displace vertices, see `EstimatorConfig.displacement`."""


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
    """Trains a graph network; `coarse.kind.NetworkKind.train` documents the arguments.

    Returns:
        The network, and the mean distance of its proxy vertices from the truth on held-out takes.

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
    skinned = [samples.skinning_error(chosen) for chosen in validation_frames(samples, plan.groups)]
    figures = {
        "frames": float(len(samples.training)),
        "held_out_mm": 1e3 * trained.error,
        "held_out_skinned_mm": 1e3 * float(np.mean(skinned)),
        "held_out_coarse_mm": 1e3 * trained.coarse_error,
        "corrective_admitted": float(trained.corrective_admitted),
    }
    return GraphNetwork(RuntimeEstimator.of(estimator, trained.arrays, dtype="float32")), figures


def estimator_of(config: SwingarConfig, betas: int) -> EstimatorConfig:
    """Returns the sizes of the estimator for options of the fit.

    Args:
        config: Options of the fit.
        betas: Number of shape coefficients of the body.
    """
    sizes = EstimatorConfig.lean() if config.sizes == "lean" else EstimatorConfig()
    features = {"told": VERTEX.count, "state_told": STATE_FEATURES, "displacement": DISPLACEMENT_WIDTH, "context": True}
    own = features if config.features else {}
    return replace(sizes, body=betas + 3 * JOINTS, alpha=config.alpha, **own)


def samples_of(frames: SplitFrames, descriptor: int) -> TakeSamples:
    """Returns the training samples of frames of takes.

    Args:
        frames: The frames with their splits.
        descriptor: Number of entries of the spectral descriptor.
    """
    return TakeSamples.of(frames.groups, [each == "train" for each in frames.splits], descriptor)
