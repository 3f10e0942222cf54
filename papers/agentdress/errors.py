"""AgentDress against settled garments: `python -m papers.agentdress.errors ANCHORS TEST`.

ANCHORS is what `hemline drape GARMENT --anchors ...` made (with `--derivatives`, rigging is measured, too), TEST a
folder for the test set, made and continued here: the garment walked (`sim.rest.walk`) into poses of clips of subjects
that are in no fit, each on one of sixteen random bodies and on the mean one. The model is fitted anew.

Prints mean distances of vertices to the settled garment, writes papers/agentdress/pages/errors-GARMENT.md and its picture, and
one JSON line to benchmarks/results/agentdress_errors.jsonl.
"""

import argparse
import json
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.fit.material_fit import MaterialChanges
from hemline.animators.agentdress.fit.rigged_anchors import RiggedAnchors, rows_with_derivatives
from hemline.animators.agentdress.fit.rigged_model import with_rigging
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bench.machine import commit, machine
from hemline.bodies import load as load_body
from hemline.compiled import use_threads
from hemline.datasets import Dataset, open_dataset
from hemline.errors import BadDataset
from papers.agentdress.compared import Errors, binding_of, on_random_bodies, on_the_mean_body, played_mm
from papers.agentdress.convergence import curve
from papers.agentdress.drawn_pairs import draw_pairs
from papers.agentdress.errors_page import write_page
from papers.agentdress.pairs import Pair, settled_nearby, settled_pairs
from papers.agentdress.pose_models import blended, nearest, ridge

ROOT = Path(__file__).parents[2]
LOOSE = -0.5
"""Bodies whose first beta is at most this: the garment hangs loose on them."""
TURN_DEG = 1.0
"""Of every joint, for the steadiness of the truth."""
NEARBY = 24
"""Poses that it is measured in."""


def main() -> None:
    """Make what is missing of the test set, measure, print, draw, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path)
    parser.add_argument("test", type=Path)
    parser.add_argument("--others", type=Path, nargs="*", default=[], help="drapes of other materials, fitted with it")
    parser.add_argument("--pairs", type=int, default=400, help="poses, each with a random body")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    use_threads(1)
    dataset = open_dataset(asked.anchors)
    garment, anchors = dataset.garment, AnchorSet.of(dataset)
    others = [open_dataset(folder) for folder in asked.others]
    materials = MaterialChanges.of(garment, anchors, others) if others else None
    model = fit_anchors(garment, anchors, AgentDressConfig(), materials=materials, progress=lambda *_: None)
    rigged = None
    with suppress(BadDataset):  # none has derivatives
        rigged = RiggedAnchors.search(dataset, rows_with_derivatives(dataset), model, anchors)
    pairs = list(settled_pairs(asked.test, garment, count=asked.pairs, seed=asked.seed, jobs=asked.jobs))
    rigging = {"rigging": rigged} if rigged else {}
    plain = {"ridge": ridge(anchors), "blend of five": blended(model, anchors), "nearest": nearest(model, anchors)}
    random = on_random_bodies(model, pairs, rigging)
    mean = on_the_mean_body(model, pairs, rigging | plain)
    by_size = curve(garment, anchors, rigged, pairs)
    by_size[len(anchors.rotations)] = {name: float(np.mean(each)) for name, each in random.items()}
    row = {
        "garment": garment.name,
        "anchors": len(anchors.rotations),
        "poses": len(anchors.rotations) + len(anchors.single_rotations),
        "rigged": len(rigged.rotations) if rigged else 0,
        "rigging_stiffness": rigged.stiffness if rigged else None,
        "rigging_validation_mm": round(rigged.validation_mm, 2) if rigged else None,
        "rigging_played_mm": round(float(np.mean(played_mm(with_rigging(rigged), pairs))), 2) if rigged else None,
        "random_bodies": _random_bodies(dataset, anchors),
        "pairs": len(pairs),
        "loose_pairs": sum(pair.betas[0] <= LOOSE for pair in pairs),
        "loosest": LOOSE,
        "without_rest": asked.pairs - len(pairs),
        "random_bodies_mm": _summed(random),
        "loose_bodies_mm": _summed(_only(random, [pair.betas[0] <= LOOSE for pair in pairs])),
        "mean_body_mm": _summed(mean),
        "steadiness_mm": round(_steadiness_mm(asked.test, model, pairs, asked.seed, asked.jobs), 2),
        "by_anchors_mm": {
            size: {name: round(value, 2) for name, value in each.items()} for size, each in by_size.items()
        },
        "machine": machine(),
        "commit": commit(),
    }
    pages = ROOT / "papers" / "agentdress" / "pages"
    missed = np.argsort(random["AgentDress"])
    some = [pairs[missed[len(missed) // 2]], pairs[missed[9 * len(missed) // 10]], pairs[missed[-1]]]
    row["drawn"] = draw_pairs(pages / f"errors-{garment.name}-pairs.png", model, some, rigging)
    print(write_page(row, pages))
    with (ROOT / "benchmarks" / "results" / "agentdress_errors.jsonl").open("a") as stream:
        stream.write(json.dumps(row) + "\n")


def _random_bodies(dataset: Dataset, anchors: AnchorSet) -> int:
    """Bodies with betas that no anchor has."""
    known = anchors.betas.shape[1]
    return sum(any(row.betas[known:]) for row in dataset.anchors())


def _summed(errors: Errors) -> dict[str, list[float]]:
    """Mean, ninth decile and worst pair."""
    return {
        name: [round(float(value), 2) for value in (np.mean(each), np.percentile(each, 90), np.max(each))]
        for name, each in errors.items()
        if each
    }


def _only(errors: Errors, which: Sequence[bool]) -> Errors:
    return {name: [value for value, asked in zip(each, which, strict=True) if asked] for name, each in errors.items()}


def _steadiness_mm(folder: Path, model: AnimatorAgentDress, pairs: Sequence[Pair], seed: int, jobs: int) -> float:
    """How far a settled garment moves, skinning apart, when every joint turns by a degree."""
    some, body, binding = pairs[:NEARBY], load_body(model.body_name).shaped(), binding_of(model)
    poses, rest, found = [pair.pose for pair in some], model.tables.rest, []
    turn = float(np.radians(TURN_DEG))
    for number, near, worn in settled_nearby(folder, model.garment, poses, turn=turn, seed=seed, jobs=jobs):
        here = binding.offsets(body.posed(poses[number]).transforms, rest, some[number].mean)
        there = binding.offsets(body.posed(near).transforms, rest, worn)
        found.append(np.linalg.norm(there - here, axis=1).mean())
    return 1e3 * float(np.mean(found))


if __name__ == "__main__":
    main()
