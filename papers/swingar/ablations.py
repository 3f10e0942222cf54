"""Measures what each part of both networks is worth on one small equal budget: the paper's Table I, Figs. 9 and 12.

    python -m papers.swingar.ablations TAKES... --judged TAKES... --checkpoints FOLDER \\
        -o benchmarks/results/swingar_ablations.jsonl

TAKES are datasets that `python -m hemline.models.make.swingar_takes` made. All variants are trained alike from scratch
with one seed, and evaluated on the datasets of `--judged`. Without these, every second take is used, and the split
holds out subjects and garments. A row is written after each variant. Rows that exist are not made again, and a killed
graph network continues from its checkpoint. `ablations_graph.py` has the variants of the graph network: after them the
plain one continues for a third of the epochs with the collision loss, with all terms, and with neither.
`ablations_page.py` writes the page.
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hemline.animators.coarse.features.columns import DYNAMIC
from hemline.animators.coarse.fit.fit import split_takes
from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.animators.coarse.fit.walk import TakeWalk
from hemline.animators.lag import LagConfig
from hemline.animators.lag.fit.lag_samples import GarmentSamples, garment_samples
from hemline.animators.swingar.fit.fit_graph import samples_of
from hemline.bench.machine import commit, machine
from hemline.datasets import open_collection
from hemline.datasets.collection import Collection, Entry
from hemline.files import content_hash
from papers.swingar.ablations_graph import Budget, names, rows_of_graph

STRIDE = 18
"""Interval between the frames that are trained on, each with the two frames before it."""
HIDDEN: dict[str, tuple[str, ...]] = {
    "all that it is told": (),
    "not how it lay at the beginning": ("beginning",),
    "not how it trails (lags and swings)": ("skinned trail", "carried trail"),
    "not what of the body is near": ("nearness", "carried nearness"),
    "not where joints are": ("joints",),
    "the present pose alone": ("skinned trail", "carried trail", "beginning"),
}
"""Variants of the lag network, with the features in `DYNAMIC` that are set to zero."""
LEARNED: dict[str, dict[str, Any]] = {
    "no mirror images": {"mirrored": False},
    "millimetres of all garments alike": {"evenness": 0.0},
    "no error of edges": {"edge_weight": 0.0},
}
"""Variants of the fit of the lag network, with their options."""


def rows_of_lag(train: list[GarmentSamples], valid: list[GarmentSamples], epochs: int, wanted: set) -> Iterator[dict]:
    """Yields rows of the lag network."""
    config = LagConfig(epochs=epochs)
    for name, hidden in HIDDEN.items():
        if name in wanted:
            shown = [[hide_features(each, hidden) for each in split] for split in (train, valid)]
            yield {"network": "lag", "variant": name} | train_lag(*shown, config)
    for name, options in LEARNED.items():
        if name in wanted:
            yield {"network": "lag", "variant": name} | train_lag(train, valid, replace(config, **options))


def hide_features(samples: GarmentSamples, names: Sequence[str]) -> GarmentSamples:
    """Returns samples in which some features of `DYNAMIC` are zero."""
    if not names:
        return samples
    features = np.array(samples.frames.features)
    for name in names:
        features[..., DYNAMIC[name]] = 0
    return replace(samples, frames=replace(samples.frames, features=features))


def train_lag(train: list[GarmentSamples], valid: list[GarmentSamples], config: LagConfig) -> dict[str, Any]:
    """Trains the lag network; returns its errors [mm]."""
    from hemline.animators.lag.fit.fit_lag import scales
    from hemline.animators.lag.fit.lag_training import LagObjective, TorchLagNet
    from hemline.learning.fit.trainer import Schedule, Trainer

    objective = LagObjective(TorchLagNet(config.width, *scales(train), 0), train, valid, config)
    Trainer(objective, Schedule(config.epochs, config.garments, config.rate, 0, 1)).run(progress=lambda *_: None)
    return {
        "error_mm": weighted(objective.errors(valid), valid),
        "trained_mm": weighted(objective.errors(train), train),
        "skinned_mm": weighted([skinning_error(each) for each in valid], valid),
        "frames": sum(len(each) for each in train),
    }


def skinning_error(samples: GarmentSamples) -> float:
    """Returns the mean error of skinning [m]."""
    return float(np.linalg.norm(samples.displacements(), axis=2).mean())


def weighted(errors: Sequence[float], samples: Sequence[GarmentSamples]) -> float:
    """Returns the mean over frames [mm]."""
    return 1e3 * float(np.average(errors, weights=[len(each) for each in samples]))


def sides_of(data: Collection, judged: int) -> tuple[list[Entry], list[Entry]]:
    """Returns takes to train on and to evaluate on: those of the last datasets, or every second one of the split."""
    if judged:
        known = len(data.datasets) - judged
        return [each for each in data.clips() if each.dataset < known], [
            each for each in data.clips() if each.dataset >= known
        ]
    sides = split_takes(data, LagConfig().held_out)
    held_out = [entry for name, entries in sides.items() if name != "train" for entry in entries]
    return sides["train"][::2], held_out[::2]


def main() -> None:
    """Makes the rows that are missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("takes", nargs="+", type=Path)
    parser.add_argument("--judged", nargs="*", type=Path, default=[], help="takes to judge by; all others are learned")
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--checkpoints", type=Path, required=True, help="a folder for those of the graph network")
    parser.add_argument("--variants", nargs="*", help="only these; all by default")
    parser.add_argument("--lag-epochs", type=int, default=10)
    parser.add_argument("--graph-epochs", type=int, default=5)
    args = parser.parse_args()
    data, size = open_collection([*args.takes, *args.judged]), LagConfig().size
    train, valid = sides_of(data, len(args.judged))
    budget = {"takes": len(train), "held_out": len(valid), "lag": args.lag_epochs, "graph": args.graph_epochs}
    budget |= {"garments": len({each.dataset for each in train}), "new": len({each.dataset for each in valid})}
    mark = content_hash(budget | {"names": [entry.row.name for entry in (*train, *valid)]})
    lines = args.out.read_text().splitlines() if args.out.exists() else []
    known = {(row["network"], row["variant"]) for row in map(json.loads, lines) if row["mark"] == mark}
    common = {"mark": mark, "budget": budget, "machine": machine(), "commit": commit()}

    def missing(network: str, names: list[str]) -> set[str]:
        return {each for each in args.variants or names if each in names and (network, each) not in known}

    def keep(rows: Iterator[dict]) -> None:
        for row in rows:
            print(
                f"{row['network']:6s} {row['variant']:40s} {row['error_mm']:6.1f} of {row['skinned_mm']:.1f}",
                flush=True,
            )
            with args.out.open("a") as file:
                file.write(json.dumps(row | common) + "\n")

    sides = {"train": train, "new_garment": valid}
    frames = SplitFrames.of(data, sides, TakeWalk(size, STRIDE), args.checkpoints / "frames")
    if wanted := missing("lag", [*HIDDEN, *LEARNED]):
        samples = [garment_samples(frames, side) for side in sides]
        keep(rows_of_lag(*samples, args.lag_epochs, wanted))
    if wanted := missing("graph", names()):
        taken = samples_of(frames, 256)
        more = Budget(args.graph_epochs, max(1, args.graph_epochs // 3), mark, args.checkpoints)
        keep(rows_of_graph(taken, len(train[0].row.betas), more, wanted))


if __name__ == "__main__":
    main()
