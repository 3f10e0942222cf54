"""AgentDress against settled garments: `python benchmarks/claims/agentdress/errors.py MODEL ANCHORS TEST`.

MODEL is a file, ANCHORS the dataset that it was fitted to, TEST a folder for the test set, made and continued here:
the garment walked (`sim.rest.walk`) into poses of clips of subjects that are in no fit, each on one of sixteen random
bodies and on the mean one. Mean distances of vertices to it are printed for what plays, for the simulation in the
place of the pose model, for the ablation of the paper's section 4.6, and for skinning.

One JSON line goes to benchmarks/results/agentdress_errors.jsonl.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies, motions
from hemline.animators.agentdress.anchor_set import AnchorSet
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.distances import anchor_weights, region_distances, turns_between
from hemline.bench.machine import commit, machine
from hemline.datasets import open_dataset
from hemline.motions.motion import Pose
from hemline.sim import produce_posed, random_shapes
from hemline.sim.takes.database import poses_of

ROOT = Path(__file__).parents[3]
CLIPS = ("run", "walk", "jump", "kick", "dance")
"""Shipped excerpts, no other clip of whose subjects is in a fit."""
SHAPES = 16


def pairs(count: int, seed: int) -> list[tuple[Pose, tuple[float, ...]]]:
    """Poses of the clips with a random body each."""
    body = bodies.load("anny24")
    poses = poses_of([motions.load(name) for name in CLIPS])
    random = np.random.default_rng(seed)
    shapes = random_shapes(body, SHAPES, seed)
    chosen = random.permutation(len(poses))[:count]
    rest = body.shaped().rest_pose.translation
    return [(Pose(poses[index], rest), shapes[number % SHAPES]) for number, index in enumerate(chosen)]


def ways(model, anchors: AnchorSet, nominal: np.ndarray, pose: Pose) -> dict:
    """Animators by name; `nominal`: offsets of the settled garment of the mean shape in the pose [m]."""
    tables = model.tables
    no_shape = replace(
        tables,
        shape_effects=np.zeros_like(tables.shape_effects),
        rest_effects=np.zeros_like(tables.rest_effects),
    )
    no_pose = replace(tables, pose_weights=np.zeros_like(tables.pose_weights))
    turns = turns_between(pose.rotations[None].astype(np.float64), anchors.rotations)
    distances = region_distances(turns, tables.influence)[0]
    options = {name: getattr(model.config, name) for name in ("neighbours", "power", "floor")}
    weights = tables.regions @ anchor_weights(distances, **options)
    blend = np.einsum("va,avi->vi", weights, anchors.offsets[:, 0])
    neither = replace(no_shape, pose_weights=no_pose.pose_weights)
    return {
        "agentdress": model,
        "simulation as pose model": replace(model, tables=replace(no_pose, offset=np.float32(nominal))),
        "pose model alone": replace(model, tables=no_shape),
        "without the first-order module": replace(model, tables=replace(neither, offset=np.float32(blend))),
        "skinning": replace(model, tables=neither),
    }


def main() -> None:
    """Make what is missing of the test set, measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model")
    parser.add_argument("anchors", type=Path)
    parser.add_argument("test", type=Path)
    parser.add_argument("--pairs", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    model, anchors = hemline.load(asked.model), AnchorSet.of(open_dataset(asked.anchors))
    tables, body = model.tables, bodies.load(model.body_name)
    binding = Binding(tables.indices, tables.weights, tables.nearest)
    errors: dict[str, list[float]] = {}
    by_shape: dict[tuple[float, ...], list[Pose]] = {}
    for pose, betas in pairs(asked.pairs, asked.seed):
        by_shape.setdefault(betas, []).append(pose)
    done, refused = 0, 0
    for betas, poses in by_shape.items():
        found = produce_posed(asked.test, model.garment, [[pose] for pose in poses], [(), betas], jobs=asked.jobs)
        dataset = open_dataset(asked.test)
        for pose, each in zip(poses, found, strict=True):
            if each is None:
                refused += 1
                continue
            plain, shaped = body.shaped().posed(pose), body.shaped(betas).posed(pose)
            mean, truth = (dataset.take(name).vertices[0] for name in each.names)
            nominal = binding.offsets(plain.transforms, tables.rest, mean)
            for name, way in ways(model, anchors, nominal, pose).items():
                apart = np.linalg.norm(way.settled(shaped) - truth, axis=1).mean()
                errors.setdefault(name, []).append(1e3 * float(apart))
            apart = np.linalg.norm(model.settled(plain) - mean, axis=1).mean()
            errors.setdefault("agentdress, mean shape", []).append(1e3 * float(apart))
            apart = np.linalg.norm(ways(model, anchors, nominal, pose)["skinning"].settled(plain) - mean, axis=1).mean()
            errors.setdefault("skinning, mean shape", []).append(1e3 * float(apart))
            done += 1
        print(f"{done} pairs, {refused} without rest", file=sys.stderr, flush=True)
    row = {
        "garment": model.garment.name,
        "anchors": model.figures["anchors"],
        "poses": model.figures["poses"],
        "pairs": done,
        "without_rest": refused,
        "error_mm": {name: round(float(np.mean(each)), 2) for name, each in errors.items()},
        "error_p90_mm": {name: round(float(np.percentile(each, 90)), 2) for name, each in errors.items()},
        "machine": machine(),
        "commit": commit(),
    }
    for name, value in row["error_mm"].items():
        print(f"{name:<32} {value:6.2f} mm, nine in ten below {row['error_p90_mm'][name]:6.2f}")
    with (ROOT / "benchmarks" / "results" / "agentdress_errors.jsonl").open("a") as stream:
        stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
