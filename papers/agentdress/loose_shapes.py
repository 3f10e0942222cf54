"""A loose garment on bodies that it was not fitted on: `python loose_shapes.py ANCHORS TEST` in this folder.

The shipped rope chains of the skirt, shown at the vertices of the light skirt, on random bodies; beside the light skirt
simulated there. On other shapes ropes hang from the garment moved as the undraped one would be (`Garment.dressed`); or
they swing on the mean body, and AgentDress, fitted to a few anchors of the light skirt, adds what the shape changes
(`AnimatorRedressed`). With the simulation on the mean body in the place of the ropes, what is missed is the shape's
part alone.

ANCHORS and TEST are folders, made here and continued; with `--motion` the clips of the anchors' poses. One JSON line
goes to benchmarks/results/agentdress_loose_shapes.jsonl; the page papers/agentdress/pages/loose_shapes.md and the picture of
its worst frames are made anew.
"""

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np

import hemline
from hemline import bodies, garments, metrics
from hemline.animators import Animator, fit
from hemline.animators.redressed import AnimatorRedressed
from hemline.arrays import Vertices
from hemline.bench.machine import commit, machine
from hemline.collide import inside
from hemline.compiled import use_threads
from hemline.datasets import Take, open_dataset
from hemline.meshes import rest_lengths
from hemline.playback import Player
from papers.agentdress.loose_anchors import SHAPES, make_anchors
from papers.agentdress.loose_page import PAGES, draw_worst, page
from papers.agentdress.loose_takes import Trial, trials
from papers.agentdress.loose_ways import Dressed, OnGrid, Simulated

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "agentdress_loose_shapes.jsonl"
GARMENT, ROPES, CLIPS = "skirt-light", "skirt", ("walk", "dance")
EVERY = 5
"""Frames from one count of vertices inside to the next."""


def ways(ropes: Animator, shapes: Animator, take: Take) -> dict[str, Animator]:
    """Each way to move the garment, by its name in the table."""
    garment = shapes.garment
    plain = OnGrid(garment, ropes)
    return {
        "ropes, garment dressed": plain,
        "ropes, redressed": AnimatorRedressed(plain, shapes),
        "simulation on the mean body, as it is": Dressed(garment, take, changed=False),
        "simulation on the mean body, garment dressed": Dressed(garment, take),
        "simulation on the mean body, redressed": AnimatorRedressed(Simulated(garment, take), shapes),
    }


def apart_mm(one: Vertices, other: Vertices) -> float:
    """Mean distance of vertices [mm]."""
    return 1e3 * float(np.linalg.norm(np.asarray(one, np.float64) - other, axis=1).mean())


def played(way: Animator, take: Take) -> tuple[dict[str, float], tuple[float, int, Vertices]]:
    """Figures of a way against a take on its body; and the error, number and vertices of the worst frame."""
    garment, body = way.garment, bodies.load(way.body_name).shaped(take.betas)
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    counted = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    player = Player.prepare(way, body, placed=True)
    dt, rows, worst = 1 / take.motion.fps, [], (-1.0, 0, take.vertices[0])
    state = player.start(take.motion[0], pre_roll=0.0, dt=dt)
    for index in range(len(take.motion)):
        state, frame = player.step(state, take.motion[index], dt)
        if take.lead_in[index]:
            continue
        error = apart_mm(frame.vertices, take.vertices[index])
        row = {
            "error_mm": error,
            "animated_mm": apart_mm(frame.animated, take.vertices[index]),
            "stretch_percent": metrics.stretch_percent(frame.vertices, edges[counted], lengths[counted])[0],
        }
        if index % EVERY == 0:
            solid = frame.body.vertices, frame.body.faces
            row["inside_percent"] = 100 * float(inside(*solid, frame.animated).mean())
        rows.append(row)
        worst = max(worst, (error, index, frame.vertices), key=lambda each: each[0])
    return {name: float(np.mean([row[name] for row in rows if name in row])) for name in rows[0] | rows[-1]}, worst


def nominal_mm(ropes: Animator, mean: Take) -> float:
    """What ropes miss on the body of their fit."""
    return played(OnGrid(garments.load(GARMENT), ropes), mean)[0]["error_mm"]


def main() -> None:
    """Make what is missing, measure, print, record, draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path, help="a folder for the anchors; made and continued")
    parser.add_argument("test", type=Path, help="a folder for the test set; made and continued")
    parser.add_argument("--motion", nargs="*", default=[], help="clips of the anchors' poses; none: they are there")
    parser.add_argument("--count", type=int, default=6, help="anchors")
    parser.add_argument("--bodies", type=int, default=4, help="random bodies")
    parser.add_argument("--seconds", type=float, default=2.0, help="how much of each clip")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    use_threads(1)
    garment = garments.load(GARMENT)
    if asked.motion:
        make_anchors(asked.anchors, garment, asked.motion, count=asked.count, seed=asked.seed)
    shapes = fit(open_dataset(asked.anchors), "agentdress")
    ropes = hemline.load(ROPES)
    assert isinstance(ropes, Animator) and isinstance(shapes, Animator)
    found = trials(asked.test, garment, CLIPS, count=asked.bodies, seconds=asked.seconds, seed=asked.seed)
    rows: list[dict[str, Any]] = []
    shown: dict[str, tuple[float, int, Vertices, Trial]] = {}
    nominal = {each.clip: nominal_mm(ropes, each.mean) for each in {trial.clip: trial for trial in found}.values()}
    for trial in found:
        for name, way in ways(ropes, shapes, trial.mean).items():
            figures, worst = played(way, trial.truth)
            rows.append({"clip": trial.clip, "body": trial.body, "way": name} | figures)
            told = "  ".join(f"{key} {value:.1f}" for key, value in figures.items())
            print(f"{trial.clip:<6} {trial.body}  {name:<46} {told}", flush=True)
            if name not in shown or worst[0] > shown[name][0]:
                shown[name] = (*worst, trial)
    row = {
        "garment": GARMENT,
        "anchors": int(shapes.figures["anchors"]),
        "shapes": len(SHAPES),
        "shape_left_out_mm": shapes.figures["shape_left_out_mm"],
        "bodies": [[round(beta, 2) for beta in each.betas] for each in found if each.clip == CLIPS[0]],
        "clips": list(CLIPS),
        "seconds": asked.seconds,
        "nominal_mm": nominal,
        "rows": rows,
        "machine": machine(),
        "commit": commit(),
    }
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")
    draw_worst(garment.faces, shown)
    text = page(row)
    (PAGES / "loose_shapes.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
