"""The fit of the lag network."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hemline.animators.coarse.features.columns import DYNAMIC, STATIC
from hemline.animators.coarse.fit.split_frames import HELD_OUT, SplitFrames
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
    """Trains a lag network.

    Args:
        frames: Frames to train on and frames to choose the best epoch by.
        config: Options of the fit.
        start: Network to continue from; None starts from skinning.
        seed: Seed of everything random.
        mark: Hash of everything that the fit depends on.
        checkpoints: Folder for the state of the training; None keeps none.
        tell: Called with the stage, the steps done and the number of steps.

    Returns:
        The network, and the mean distances of its proxy vertices and of skinned ones from the truth on each split.

    Raises:
        BadModel: The training diverged.
    """
    import torch

    from hemline.learning.fit.device import usable_device
    from hemline.learning.fit.trainer import Checkpoint, Schedule, Trainer

    from .lag_training import LagObjective, TorchLagNet

    samples = {name: garment_samples(frames, name) for name in ("train", *HELD_OUT)}
    train, valid = samples["train"], [each for name in HELD_OUT for each in samples[name]]
    device = usable_device(config.device)
    if device.type == "cuda":
        torch.set_float32_matmul_precision("high")  # TF32, several times as fast
    net = TorchLagNet(config.width, *scales(train), seed, config.precision).to(device)
    if start is not None:
        net.load_weights(start.net)
    objective = LagObjective(net, train, valid, config)
    trainer = Trainer(objective, Schedule(config.epochs, config.garments, config.rate, seed, config.threads))
    checkpoint = Checkpoint(checkpoints / "lag.safetensors", mark, 1, seconds=60.0) if checkpoints else None
    trainer.run(checkpoint=checkpoint, progress=lambda *done: tell("learn", *done))
    figures = {"frames": float(sum(len(each) for each in train))}
    for name, each in samples.items():
        if each:
            figures[f"{name}_mm"] = 1e3 * _mean(objective.errors(each), each)
            figures[f"{name}_skinned_mm"] = 1e3 * _mean([_skinning_error(one) for one in each], each)
    return LagNetwork(net.to_runtime()), figures


def scales(samples: Sequence[GarmentSamples]) -> tuple[np.ndarray, np.ndarray]:
    """Returns mean and spread of each feature, float32; the spread of a constant feature is 1."""
    count, sums = 0, np.zeros(STATIC.count + DYNAMIC.count)
    squares = sums.copy()
    for each in samples:
        features = each.features(np.arange(0, len(each), max(1, len(each) // 20))).astype(np.float64)
        frames, verts = features.shape[:2]
        static = np.broadcast_to(each.frames.static.astype(np.float64), (frames, *each.frames.static.shape))
        rows = np.concatenate([static, features], axis=2).reshape(frames * verts, -1)
        sums, squares, count = sums + rows.sum(axis=0), squares + (rows**2).sum(axis=0), count + len(rows)
    mean = sums / count
    spread = np.sqrt(np.maximum(squares / count - mean**2, 0))
    return mean.astype(np.float32), np.where(spread < 1e-4, 1, np.maximum(spread, 0.01)).astype(np.float32)


def _skinning_error(samples: GarmentSamples) -> float:
    return float(np.linalg.norm(samples.displacements(), axis=2).mean())


def _mean(errors: Sequence[float], samples: Sequence[GarmentSamples]) -> float:
    return float(np.average(errors, weights=[len(each) for each in samples]))
