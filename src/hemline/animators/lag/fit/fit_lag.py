"""The fit of the lag network."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hemline.animators.coarse.fit.split_frames import HELD_OUT, SplitFrames
from hemline.animators.coarse.proxy_on_body import DYNAMIC_COUNT, STATIC_COUNT
from hemline.animators.lag.config import LagConfig
from hemline.animators.lag.lag_network import LagNetwork

from .lag_samples import GarmentSamples, garment_samples


def fit_lag(
    frames: SplitFrames,
    config: LagConfig,
    *,
    start: LagNetwork | None,
    seed: int,
    mark: str,
    checkpoints: Path | None,
    tell: Callable[[str, int, int], None],
) -> tuple[LagNetwork, dict[str, float]]:
    """Learn.

    Args:
        frames: Frames to learn from, `train`, and frames to choose the best epoch by, by what is new about them.
        config: Options.
        start: What to go on from; None: from skinning.
        seed: Seed of all that is random.
        mark: Hash of all that the fit depends on.
        checkpoints: A folder for the state of the training; None: it is not kept.
        tell: Called with stage, steps done and steps in all.

    Returns:
        The network, and its errors on each side beside those of skinning, mean distance of proxy vertices.

    Raises:
        BadModel: The training diverged.
    """
    from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer

    from .lag_training import LagObjective, TorchLagNet

    samples = {name: garment_samples(frames, name) for name in ("train", *HELD_OUT)}
    train, valid = samples["train"], [each for name in HELD_OUT for each in samples[name]]
    net = TorchLagNet(config.width, *scales(train), seed, config.precision)
    if start is not None:
        net.load_weights(start.net)
    objective = LagObjective(net, train, valid, config)
    trainer = Trainer(objective, Schedule(config.epochs, config.garments, config.rate, seed, config.threads))
    kept = Checkpoint(checkpoints / "lag.safetensors", mark, 1, seconds=60.0) if checkpoints else None
    trainer.run(checkpoint=kept, progress=lambda *done: tell("learn", *done))
    figures = {"frames": float(sum(len(each) for each in train))}
    for name, each in samples.items():
        if each:
            figures[f"{name}_mm"] = 1e3 * _mean(objective.errors(each), each)
            figures[f"{name}_skinned_mm"] = 1e3 * _mean([_skinning_error(one) for one in each], each)
    return LagNetwork(net.played()), figures


def scales(samples: Sequence[GarmentSamples]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and spread of each feature, float32; of a feature that is always the same the spread is 1."""
    count, sums = 0, np.zeros(STATIC_COUNT + DYNAMIC_COUNT)
    squares = sums.copy()
    for each in samples:
        told = each.told(np.arange(0, len(each), max(1, len(each) // 20))).astype(np.float64)
        frames, verts = told.shape[:2]
        static = np.broadcast_to(each.worn.static.astype(np.float64), (frames, *each.worn.static.shape))
        rows = np.concatenate([static, told], axis=2).reshape(frames * verts, -1)
        sums, squares, count = sums + rows.sum(axis=0), squares + (rows**2).sum(axis=0), count + len(rows)
    mean = sums / count
    spread = np.sqrt(np.maximum(squares / count - mean**2, 0))
    return mean.astype(np.float32), np.where(spread < 1e-4, 1, np.maximum(spread, 0.01)).astype(np.float32)


def _skinning_error(samples: GarmentSamples) -> float:
    return float(np.linalg.norm(samples.apart(), axis=2).mean())


def _mean(errors: Sequence[float], samples: Sequence[GarmentSamples]) -> float:
    return float(np.average(errors, weights=[len(each) for each in samples]))
