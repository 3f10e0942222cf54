"""What each part of swingar's two networks is worth, on one small equal budget: the paper's Tables I, Figs. 9 and 12.

    python benchmarks/claims/swingar/ablations.py TAKES... -o benchmarks/results/swingar_ablations.jsonl

TAKES are datasets that `python -m hemline.models.make.swingar_takes` made. Every second take is used. Each variant is
trained alike, from nothing, with one seed, and judged on takes of subjects and garments that are held out. A row is
written after each; rows that are there are not made again. `ablations_page.py` makes a page of them.
"""

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.features.proxy_on_body import BEGUN, DESCRIBED, PARTS, TRAILS
from hemline.animators.swingar.fit import divided
from hemline.animators.swingar.graph.descriptor import Descriptor
from hemline.animators.swingar.graph.fit_graph import estimator_of
from hemline.animators.swingar.graph.graph_samples import TakeSamples, take_samples
from hemline.animators.swingar.lag.lag_samples import GarmentSamples, gather
from hemline.bench.machine import commit, machine
from hemline.datasets import open_collection
from hemline.datasets.collection import Collection, Entry
from hemline.files import content_hash

STRIDE = 6
"""Every so many frames are learned from."""
NEAR = slice(2 * TRAILS + 6, 2 * TRAILS + 6 + 8 * len(PARTS))
"""Columns that tell what of the body is near."""
HIDDEN: dict[str, list[slice]] = {
    "all that it is told": [],
    "not how it lay at the beginning": [slice(DESCRIBED, DESCRIBED + BEGUN)],
    "not how it trails (lags and swings)": [slice(0, 2 * TRAILS)],
    "not what of the body is near": [NEAR],
    "not where joints are": [slice(NEAR.stop, DESCRIBED)],
    "the present pose alone": [slice(0, 2 * TRAILS), slice(DESCRIBED, DESCRIBED + BEGUN)],
}
"""Variants of the lag network: columns that are zero."""
LEARNED: dict[str, dict[str, Any]] = {
    "no mirror images": {"mirrored": False},
    "millimetres of all garments alike": {"evenness": 0.0},
    "no error of edges": {"edge_weight": 0.0},
}
"""Variants of its fit."""
GRAPH: dict[str, dict[str, Any]] = {
    "as the paper, with lag features": {},
    "no lag features": {"lag": 0},
    "no descriptor": {"global_shape": "none"},
    "graph pooling": {"global_shape": "pooled"},
    "Euclidean affinity": {"distance": "euclidean"},
    "z = 128": {"descriptor": 128},
    "z = 512": {"descriptor": 512},
    "alpha = 1": {"alpha": 1.0},
    "alpha = 3": {"alpha": 3.0},
    "no Lipschitz normalisation": {"lipschitz": False},
}
"""Variants of the graph network: options of its sizes, and `distance`, that of the descriptor."""


def rows_of_lag(train: list[GarmentSamples], valid: list[GarmentSamples], epochs: int, known: set) -> Iterator[dict]:
    """Rows of the lag network."""
    config = SwingarConfig(epochs=epochs)
    for name, columns in HIDDEN.items():
        if ("lag", name) not in known:
            shown = [[hidden(each, columns) for each in side] for side in (train, valid)]
            yield {"network": "lag", "variant": name} | lag_trained(*shown, config)
    for name, options in LEARNED.items():
        if ("lag", name) not in known:
            yield {"network": "lag", "variant": name} | lag_trained(train, valid, replace(config, **options))


def hidden(samples: GarmentSamples, columns: Sequence[slice]) -> GarmentSamples:
    """Samples with columns of what vertices are told set to zero."""
    if not columns:
        return samples
    told = samples.told.copy()
    for each in columns:
        told[..., each] = 0
    return replace(samples, told=told)


def lag_trained(train: list[GarmentSamples], valid: list[GarmentSamples], config: SwingarConfig) -> dict[str, Any]:
    """Train the lag network; its errors [mm]."""
    from hemline.animators.swingar.lag.fit_lag import scales
    from hemline.animators.swingar.lag.lag_training import LagObjective, TorchLagNet
    from hemline.learning.trainer import Schedule, Trainer

    objective = LagObjective(TorchLagNet(config.width, *scales(train), 0), train, valid, config)
    Trainer(objective, Schedule(config.epochs, config.garments, config.rate, 0, 1)).run(progress=lambda *_: None)
    return {
        "error_mm": weighted(objective.errors(valid), valid),
        "trained_mm": weighted(objective.errors(train), train),
        "skinned_mm": weighted([skinned(each) for each in valid], valid),
        "frames": sum(len(each.told) for each in train),
    }


def skinned(samples: GarmentSamples) -> float:
    """Error of skinning [m]."""
    return float(np.linalg.norm(samples.apart.astype(np.float32), axis=2).mean())


def weighted(errors: Sequence[float], samples: Sequence[GarmentSamples]) -> float:
    """Mean over frames [mm]."""
    return 1e3 * float(np.average(errors, weights=[len(each.told) for each in samples]))


def rows_of_graph(samples: TakeSamples, betas: int, epochs: int, known: set) -> Iterator[dict]:
    """Rows of the graph network."""
    from hemline.animators.swingar.graph.train_estimator import TrainingPlan, train_estimator

    plan = TrainingPlan(coarse_epochs=epochs, term_epochs=0, corrective_epochs=0, patience=0)
    for name, options in GRAPH.items():
        if ("graph", name) in known:
            continue
        sizes = {key: value for key, value in options.items() if key != "distance"}
        config = replace(estimator_of(SwingarConfig(), betas), **sizes)
        shown = described(samples, config.descriptor, options.get("distance", "geodesic"))
        trained = train_estimator(shown, config, plan, seed=0, mark="", folder=None, progress=lambda *_: None)
        curve = [1e3 * each for each in trained.curves["coarse"]]
        yield {
            "network": "graph",
            "variant": name,
            "error_mm": 1e3 * trained.coarse_error,
            "skinned_mm": curve[0],
            "curve_mm": curve,
            "frames": plan.frames * plan.epoch * epochs,
        }


def described(samples: TakeSamples, size: int, distance: Any) -> TakeSamples:
    """Samples with another descriptor."""
    found = []
    for each in samples.garments:
        points = each.features[:, 3:6]
        own = Descriptor.of(points, each.faces, size=min(size, len(points)), distance=distance)
        found.append(replace(each, descriptor=own.padded_to(size)))
    return replace(samples, garments=found)


def sides_of(data: Collection) -> tuple[list[Entry], list[Entry]]:
    """Every second take to learn from, and every second one that is held out."""
    sides = divided(data, SwingarConfig().held_out)
    held_out = [entry for name, entries in sides.items() if name != "train" for entry in entries]
    return sides["train"][::2], held_out[::2]


def main() -> None:
    """Make the rows that are missing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("takes", nargs="+", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--lag-epochs", type=int, default=10)
    parser.add_argument("--graph-epochs", type=int, default=5)
    args = parser.parse_args()
    data, size = open_collection(args.takes), SwingarConfig().size
    train, valid = sides_of(data)
    budget = {"takes": len(train), "held_out": len(valid), "lag": args.lag_epochs, "graph": args.graph_epochs}
    mark = content_hash(budget | {"names": [entry.row.name for entry in (*train, *valid)]})
    lines = args.out.read_text().splitlines() if args.out.exists() else []
    known = {(row["network"], row["variant"]) for row in map(json.loads, lines) if row["mark"] == mark}
    told = {"mark": mark, "budget": budget, "machine": machine(), "commit": commit()}

    def keep(rows: Callable[[], Iterator[dict]]) -> None:
        for row in rows():
            print(
                f"{row['network']:6s} {row['variant']:40s} {row['error_mm']:6.1f} of {row['skinned_mm']:.1f}",
                flush=True,
            )
            with args.out.open("a") as file:
                file.write(json.dumps(row | told) + "\n")

    if any(("lag", name) not in known for name in (*HIDDEN, *LEARNED)):
        samples = [gather(data, side, STRIDE, size) for side in (train, valid)]
        keep(lambda: rows_of_lag(*samples, args.lag_epochs, known))
        del samples
    if any(("graph", name) not in known for name in GRAPH):
        taken = take_samples(data, train, valid, STRIDE, 256, size)
        keep(lambda: rows_of_graph(taken, len(train[0].row.betas), args.graph_epochs, known))


if __name__ == "__main__":
    main()
