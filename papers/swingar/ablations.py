"""Measures what each part of both networks is worth on one small equal budget: the paper's Table I, Figs. 9 and 12.

    python -m papers.swingar.ablations TAKES... --judged TAKES... --checkpoints FOLDER \\
        -o benchmarks/results/swingar_ablations.jsonl

TAKES are datasets that `python -m hemline.models.make.swingar_takes` made. All variants are trained alike from scratch.
Their best epoch is chosen by takes of subjects that are not trained on, and they are evaluated on the datasets of
`--judged`. Without these, every second take is used, and the garments that the split holds out are evaluated.

A row is written after each variant. Rows that exist are not made again, and a killed graph network continues from its
checkpoint. `ablations_graph.py` has the variants of the graph network: after them the plain one continues for a third
of the epochs with the collision loss, with all terms, and with neither. `ablations_page.py` writes the page.
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
from hemline.animators.swingar.fit.graph_samples import TakeSamples
from hemline.animators.swingar.fit.train_estimator import TrainingPlan
from hemline.bench.machine import commit, machine
from hemline.datasets import open_collection
from hemline.datasets.collection import Collection, Entry
from hemline.files import content_hash
from papers.swingar.ablations_graph import Budget, names, rows_of_graph

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


def rows_of_lag(splits: list[list[GarmentSamples]], epochs: int, wanted: set) -> Iterator[dict]:
    """Yields rows of the lag network.

    Args:
        splits: Samples to train on, to choose the best epoch by, and to evaluate on.
        epochs: Number of epochs.
        wanted: Names of the variants.
    """
    config = LagConfig(epochs=epochs)
    for name, hidden in HIDDEN.items():
        if name in wanted:
            shown = [[hide_features(each, hidden) for each in split] for split in splits]
            yield {"network": "lag", "variant": name} | train_lag(*shown, config)
    for name, options in LEARNED.items():
        if name in wanted:
            yield {"network": "lag", "variant": name} | train_lag(*splits, replace(config, **options))


def hide_features(samples: GarmentSamples, names: Sequence[str]) -> GarmentSamples:
    """Returns samples in which some features of `DYNAMIC` are zero."""
    if not names:
        return samples
    features = np.array(samples.frames.features)
    for name in names:
        features[..., DYNAMIC[name]] = 0
    return replace(samples, frames=replace(samples.frames, features=features))


def train_lag(
    train: list[GarmentSamples], valid: list[GarmentSamples], judged: list[GarmentSamples], config: LagConfig
) -> dict[str, Any]:
    """Trains the lag network, chooses its best epoch by `valid`; returns its errors [mm]."""
    from hemline.animators.lag.fit.fit_lag import scales
    from hemline.animators.lag.fit.lag_training import LagObjective, TorchLagNet
    from hemline.learning.fit.trainer import Schedule, Trainer

    objective = LagObjective(TorchLagNet(config.width, *scales(train), 0), train, valid, config)
    Trainer(objective, Schedule(config.epochs, config.garments, config.rate, 0, 1)).run(progress=lambda *_: None)
    return {
        "error_mm": weighted(objective.errors(judged), judged),
        "trained_mm": weighted(objective.errors(train), train),
        "skinned_mm": weighted([skinning_error(each) for each in judged], judged),
        "frames": sum(len(each) for each in train),
    }


def skinning_error(samples: GarmentSamples) -> float:
    """Returns the mean error of skinning [m]."""
    return float(np.linalg.norm(samples.displacements(), axis=2).mean())


def weighted(errors: Sequence[float], samples: Sequence[GarmentSamples]) -> float:
    """Returns the mean over frames [mm]."""
    return 1e3 * float(np.average(errors, weights=[len(each) for each in samples]))


def sides_of(data: Collection, judged: int) -> dict[str, list[Entry]]:
    """Returns takes to train on, to choose the best epoch by (of other subjects), and to evaluate on.

    Args:
        data: The datasets.
        judged: Number of datasets, the last ones, to evaluate on. Without any, every second take of the split is used,
            and those of garments that are not trained on are evaluated.
    """
    known = len(data.datasets) - judged if judged else len(data.datasets)
    own = replace(data, datasets=data.datasets[:known])
    sides = split_takes(own, LagConfig().held_out, garments=not judged)
    if judged:
        last = [each for each in data.clips() if each.dataset >= known]
        return {"train": sides["train"], "new_clip": sides["new_clip"], "judged": last}
    last = [*sides["new_garment"], *sides["both_new"]]
    return {"train": sides["train"][::2], "new_clip": sides["new_clip"][::2], "judged": last[::2]}


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
    parser.add_argument("--frames", type=int, default=4, help="frames of a garment in a batch of the graph network")
    parser.add_argument("--groups", type=int, default=100, help="groups of frames in an epoch of the graph network")
    parser.add_argument("--stride", type=int, default=18, help="interval between the frames that are trained on")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="seeds of the graph network")
    parser.add_argument("--device", default="cpu", help="device of the graph network, cpu or cuda")
    args = parser.parse_args()
    data, size = open_collection([*args.takes, *args.judged]), LagConfig().size
    sides = sides_of(data, len(args.judged))
    budget = {"takes": len(sides["train"]), "held_out": len(sides["judged"]), "lag": args.lag_epochs}
    budget |= {"graph": args.graph_epochs, "graph_frames": args.frames * args.groups}
    budget |= {"garments": len({each.dataset for each in sides["train"]})}
    budget |= {"new": len({each.dataset for each in sides["judged"]})}
    mark = content_hash(budget | {name: [entry.row.name for entry in each] for name, each in sides.items()})
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

    frames = SplitFrames.of(data, sides, TakeWalk(size, args.stride), args.checkpoints / "frames")
    if wanted := missing("lag", [*HIDDEN, *LEARNED]):
        keep(rows_of_lag([garment_samples(frames, side) for side in sides], args.lag_epochs, wanted))
    if wanted := missing("graph", names()):
        plan = TrainingPlan(frames=args.frames, epoch=args.groups, warm_up=50, device=args.device)
        more = max(1, args.graph_epochs // 3)
        trained = Budget(args.graph_epochs, more, plan, tuple(args.seeds), mark, args.checkpoints)
        learned, judged = sides_as_samples(frames)
        keep(rows_of_graph(learned, judged, len(sides["train"][0].row.betas), trained, wanted))


def sides_as_samples(frames: SplitFrames) -> tuple[TakeSamples, TakeSamples]:
    """Returns samples to train on and to choose epochs by, and samples to evaluate on, which are the validation set of
    the second."""
    samples = samples_of(frames, 256)
    names, held_out = np.concatenate(frames.splits), samples.validation
    chosen = names[held_out] == "new_clip"
    return replace(samples, validation=held_out[chosen]), replace(samples, validation=held_out[~chosen])


if __name__ == "__main__":
    main()
