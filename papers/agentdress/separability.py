"""Whether pose and shape can be told apart near an anchor: `python .../separability.py MODEL ANCHORS TEST`.

MODEL is a file or the name of a shipped model, ANCHORS the dataset that it was fitted to, TEST a folder for what is
settled here, made and continued. From one anchor on the mean shape a number of random directions is gone in poses and
betas together (unit vectors of three numbers a joint and four betas, times a distance r). There the garment is settled
from two starts, and compared with Eq. 3 of the paper: with three simulated garments (theoretical), and with the models
in their place (practical). The anchor is the first one, in random order, whose garment finds a balance where it lies.
From there it is also followed without friction, where that has a balance, too: friction holds cloth where it was led.

A JSON line for each goes to benchmarks/results/agentdress_separability.jsonl; the page papers/agentdress/pages/separability.md
and its picture are made anew.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

import hemline
from hemline import bodies
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.datasets import open_dataset
from hemline.motions.motion import Pose
from hemline.sim import Rest, settle
from papers.agentdress.neighbours import Followed, Place, Walked, balanced, directions, moved, without_friction
from papers.agentdress.separability_page import write
from papers.agentdress.synthesis import Synthesis

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "agentdress_separability.jsonl"
DISTANCES = (1.0, 0.5, 0.25, 0.125)
NEAR = 1 / 128
"""A distance at which hardly anything changes: what is missed there is the floor of the settling itself."""
SLOPED = (0.5, 0.25, 0.125)
"""Distances that a slope is taken over."""


def slope(errors: dict[float, float], floor: float = 0.0) -> float:
    """Exponent p of error ~ r^p over `SLOPED`, by least squares in the logarithms.

    Args:
        errors: By distance.
        floor: An error that is there at every distance and independent of it; its square is taken off.
    """
    squares = np.array([errors[r] ** 2 - floor**2 for r in SLOPED])
    if not (squares > 0).all():
        return float("nan")
    return float(np.polyfit(np.log(SLOPED), 0.5 * np.log(squares), 1)[0])


def chosen(anchors: AnchorSet, garment, seed: int) -> tuple[int, int, Rest]:
    """Number of the anchor, how many were tried, and its garment in balance."""
    shaped = bodies.load(garment.body_name).shaped()
    for tried, number in enumerate(np.random.default_rng(seed).permutation(len(anchors.rotations)), 1):
        pose = Pose(anchors.rotations[number].astype(np.float32), shaped.rest_pose.translation)
        found = balanced(settle(garment, shaped, pose, method="walked"))
        if found is not None:
            return int(number), tried, found
    raise SystemExit("no anchor's garment finds a balance where it lies")


def missed(way: Walked | Followed, synthesis: Synthesis, anchor: Pose, each: np.ndarray) -> dict[str, list[float]]:
    """Mean distances of vertices to the simulation, by way to synthesise, one for each direction that settled [mm]."""
    at_anchor, found = way.at((anchor, ())), {}
    if at_anchor is None:
        raise SystemExit("the anchor's own garment does not settle")
    for step in each:
        pose, betas = moved(anchor, step)
        places: list[Place] = [(pose, betas), (pose, ()), (anchor, betas)]
        truth, posed, shaped = (way.at(place) for place in places)
        if truth is None or posed is None or shaped is None:
            continue
        for name, guess in synthesis.all(anchor, pose, betas, at_anchor, posed, shaped).items():
            found.setdefault(name, []).append(1e3 * float(np.linalg.norm(guess - truth, axis=1).mean()))
    return found


def main() -> None:
    """Settle what is missing, measure, print, record, draw."""
    parser = argparse.ArgumentParser(description="Whether pose and shape can be told apart near an anchor.")
    parser.add_argument("model")
    parser.add_argument("anchors", type=Path)
    parser.add_argument("test", type=Path)
    parser.add_argument("--walked", type=int, default=5, help="directions that are walked to; the paper has 100")
    parser.add_argument("--followed", type=int, default=20, help="directions that are followed")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    use_threads(1)
    model, dataset = hemline.load(asked.model), open_dataset(asked.anchors)
    anchors = AnchorSet.of(dataset)
    number, tried, rest = chosen(anchors, model.garment, asked.seed)
    print(f"anchor {number}, {tried} tried", file=sys.stderr, flush=True)
    synthesis, rows = Synthesis(model, dataset, anchors), []
    ways = [(Walked(asked.test, rest), asked.walked), (Followed(asked.test, rest), asked.followed)]
    slippery = without_friction(rest)
    if slippery is not None:
        name = "followed without friction"
        ways.append((Followed(asked.test / "without-friction", slippery, name), asked.followed))
    for way, count in ways:
        errors: dict[str, dict[float, float]] = {}
        settled = {}
        for r in (*DISTANCES, NEAR):
            found = missed(way, synthesis, rest.pose, r * directions(count, asked.seed))
            settled[r] = len(next(iter(found.values()), []))
            for name, each in found.items():
                errors.setdefault(name, {})[r] = float(np.mean(each))
            told = ", ".join(f"{name} {np.mean(each):.3f}" for name, each in found.items())
            print(f"{way.name}, r {r:g}, {settled[r]} of {count}: {told} mm", flush=True)
        slopes = {
            name: {"plain": slope(by_r), "floor_removed": slope(by_r, by_r[NEAR])} for name, by_r in errors.items()
        }
        for name, both in slopes.items():
            print(f"  {name:<28} slope {both['plain']:.2f}, floor removed {both['floor_removed']:.2f}", flush=True)
        rows.append(
            {
                "garment": model.garment.name,
                "start": way.name,
                "anchor": number,
                "anchors_tried": tried,
                "anchors": len(anchors.rotations),
                "directions": count,
                "settled": settled,
                "error_mm": errors,
                "slope": slopes,
                "machine": machine(),
                "threads": 1,
                "commit": commit(),
            }
        )
    with RESULTS.open("a") as stream:
        stream.writelines(json.dumps(row) + "\n" for row in rows)
    write(rows, (*DISTANCES, NEAR), model.garment.name)


if __name__ == "__main__":
    main()
