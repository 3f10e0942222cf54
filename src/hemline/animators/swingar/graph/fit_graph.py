"""The fit of the graph network."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from hemline.animators.swingar.config import SwingarConfig
from hemline.animators.swingar.mover import GraphMover
from hemline.datasets.collection import Collection, Entry

from .estimator_config import JOINTS, EstimatorConfig
from .graph_inputs import LAG
from .graph_samples import take_samples
from .runtime import PlayedEstimator


def fit_graph(
    data: Collection,
    sides: Mapping[str, Sequence[Entry]],
    config: SwingarConfig,
    *,
    start: GraphMover | None,
    seed: int,
    mark: str,
    checkpoints: Path | None,
    tell: Callable[[str, int, int], None],
) -> tuple[GraphMover, dict[str, float]]:
    """Learn; arguments as `fit_lag.fit_lag`.

    Returns:
        The network, and its error on takes that are not learned from, mean distance of proxy vertices.

    Raises:
        BadModel: The training diverged.
    """
    from .train_estimator import TrainingPlan, train_estimator

    held_out = [entry for name, entries in sides.items() if name != "train" for entry in entries]
    estimator = estimator_of(config, len(held_out[0].row.betas)) if start is None else start.estimator.config
    sizes = estimator.descriptor, config.size
    samples = take_samples(data, sides["train"], held_out, config.stride, *sizes, lambda *done: tell("read", *done))
    plan = TrainingPlan(
        coarse_epochs=config.epochs,
        term_epochs=config.epochs // 4,
        corrective_epochs=config.epochs // 2,
        frames=config.frames,
        garments=config.garments,
        rate=config.rate,
        threads=config.threads,
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
    )
    figures = {
        "frames": float(len(samples.training)),
        "held_out_mm": 1e3 * trained.error,
        "held_out_coarse_mm": 1e3 * trained.coarse_error,
        "corrective_admitted": float(trained.corrective_admitted),
    }
    return GraphMover(PlayedEstimator.of(estimator, trained.arrays, dtype="float32")), figures


def estimator_of(config: SwingarConfig, betas: int) -> EstimatorConfig:
    """The sizes that options ask for.

    Args:
        config: The options.
        betas: Shape coefficients of the body.
    """
    lag, body = LAG if config.lag_features else 0, betas + 3 * JOINTS
    made = EstimatorConfig.lean if config.sizes == "lean" else EstimatorConfig
    return replace(made(lag=lag, body=body), alpha=config.alpha)
