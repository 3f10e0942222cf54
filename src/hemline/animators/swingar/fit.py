"""From takes of many garments to a model that is worn by garments never seen."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hemline import bodies
from hemline.animators.base import Progress
from hemline.datasets.collection import Collection, Entry
from hemline.datasets.take import take_metadata
from hemline.errors import BadDataset
from hemline.files import content_hash

from .config import SwingarConfig
from .lag_samples import GarmentSamples, gather
from .proxy_on_body import DYNAMIC, STATIC
from .relatives import Relatives

if TYPE_CHECKING:
    from .wearable import Swingar

SIDES = ("new_clip", "new_garment", "both_new")
"""What epochs are chosen by."""


def fit(
    data: Collection,
    config: SwingarConfig | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> "Swingar":
    """Learn from takes of many garments.

    Some subjects and some garments are held out: the epoch that is kept is the one that errs least on them.

    Args:
        data: Takes of proxies.
        config: Options.
        seed: Seed of all that is random.
        progress: Called with stage, steps done and steps in all.
        checkpoints: A folder for the state of the training: a fit that was killed goes on from there.

    Raises:
        BadDataset: Fewer than three garments or subjects, or nothing to learn from or to choose by.
        BadModel: The training diverged.
    """
    from hemline.learning.trainer import Checkpoint, Schedule, Trainer

    from .lag_training import LagObjective, TorchLagNet
    from .wearable import Swingar
    from .weights import Weights

    config, tell = config or SwingarConfig(), progress or (lambda *_: None)
    sides = divided(data, config.held_out)
    train = gather(data, sides["train"], config.stride, lambda *done: tell("read", *done))
    valid = {name: gather(data, sides[name], config.stride) for name in SIDES}
    if not train or not any(valid.values()):
        raise BadDataset("swingar needs takes to learn from and takes to choose by", "none", "simulate more garments")
    net = TorchLagNet(config.width, *scales(train), seed)
    chosen_by = [each for name in SIDES for each in valid[name]]
    objective = LagObjective(net, train, chosen_by, config)
    trainer = Trainer(objective, Schedule(config.epochs, config.garments, config.rate, seed, config.threads))
    kept = None
    if checkpoints is not None:
        checkpoints.mkdir(parents=True, exist_ok=True)
        mark = content_hash(asdict(config) | {"seed": seed, "takes": [each.row.name for each in sides["train"]]})
        kept = Checkpoint(checkpoints / "lag.safetensors", mark, 1)
    trainer.run(checkpoint=kept, progress=lambda *done: tell("learn", *done))
    figures = {
        "garments": float(len({each.garment for each in train})),
        "takes": float(len(sides["train"])),
        "frames": float(sum(len(each.told) for each in train)),
    }
    for name, samples in valid.items():
        if samples:
            figures[f"{name}_mm"] = 1e3 * _mean(objective.errors(samples), samples)
            figures[f"{name}_skinned_mm"] = 1e3 * _mean([_skinned(each) for each in samples], samples)
    figures["train_mm"] = 1e3 * _mean(objective.errors(train), train)
    known = Relatives.of_garments([data.garments[each] for each in sorted({each.garment for each in train})])
    return Swingar(Weights(config, net.played(), known, figures, licences_of(data)).rounded())


def licences_of(data: Collection) -> list[str]:
    """Notices of the bodies and of the motions, each once."""
    found = {bodies.load(garment.body_name).licence: None for garment in data.garments}
    for entry in data.clips():
        found[take_metadata(data.datasets[entry.dataset].path(entry.row.name))["motion"]["licence"]] = None
    return sorted(each for each in found if each)


def divided(data: Collection, held_out: float) -> dict[str, list[Entry]]:
    """Takes to learn from, and those of new subjects, of new garments, and of both."""
    shares = (1 - held_out, held_out, 0.0)
    known = [{id_of(entry) for entry in data.split("train", by=by, fractions=shares)} for by in ("subject", "garment")]
    found: dict[str, list[Entry]] = {name: [] for name in ("train", *SIDES)}
    for entry in data.clips():
        clip, garment = (id_of(entry) in each for each in known)
        name = "train" if clip and garment else "new_clip" if garment else "new_garment" if clip else "both_new"
        found[name].append(entry)
    return found


def id_of(entry: Entry) -> tuple[int, str]:
    """Which take it is."""
    return entry.dataset, entry.row.name


def scales(samples: Sequence[GarmentSamples]) -> tuple[np.ndarray, np.ndarray]:
    """Mean and spread of each feature, float32; of a feature that is always the same the spread is 1."""
    count, sums = 0, np.zeros(STATIC + DYNAMIC)
    squares = sums.copy()
    for each in samples:
        told = each.told[:: max(1, len(each.told) // 20)].astype(np.float64)
        frames, verts = told.shape[:2]
        static = np.broadcast_to(each.proxy.static.astype(np.float64), (frames, *each.proxy.static.shape))
        rows = np.concatenate([static, told], axis=2).reshape(frames * verts, -1)
        sums, squares, count = sums + rows.sum(axis=0), squares + (rows**2).sum(axis=0), count + len(rows)
    mean = sums / count
    spread = np.sqrt(np.maximum(squares / count - mean**2, 0))
    return mean.astype(np.float32), np.where(spread < 1e-4, 1, np.maximum(spread, 0.01)).astype(np.float32)


def _skinned(samples: GarmentSamples) -> float:
    return float(np.linalg.norm(samples.apart.astype(np.float32), axis=2).mean())


def _mean(errors: Sequence[float], samples: Sequence[GarmentSamples]) -> float:
    return float(np.average(errors, weights=[len(each.told) for each in samples]))
