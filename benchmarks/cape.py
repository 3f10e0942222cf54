"""Measures the shipped cape on clips outside its fit: `python -m benchmarks.cape [DATASET]`.

Plays the six shipped excerpts, and counts vertices inside the body by libigl's winding number in every frame. With the
dataset of the fit it also compares the test split with the simulation, driven by simulated bones and by the model's
own. Writes one JSON line per clip to benchmarks/results/cape-quality.jsonl.
"""

import argparse
import json
from pathlib import Path

import igl
import numpy as np

import hemline
from hemline.bench.machine import commit, machine

RESULTS = Path(__file__).parent / "results" / "cape-quality.jsonl"


class LibiglCounter:
    """Counts vertices inside the body after the projection with libigl's winding number."""

    def __init__(self):
        self.inside, self.frames = 0, 0

    def __call__(self, frame):
        body = frame.body
        winding = igl.winding_number(
            np.asarray(body.vertices, np.float64),
            np.asarray(body.shaped.body.faces, np.int64),
            np.asarray(frame.vertices, np.float64),
        )
        free = np.ones(len(frame.vertices), bool)
        free[frame.report.pinched] = False
        self.inside += int((np.abs(winding[free]) > 0.5).sum())
        self.frames += 1


def row(cape, body, motion, **options):
    counter = LibiglCounter()
    figures = hemline.evaluate(cape, body, motion, keep=counter, **options).figures
    names = ("drive", "frames", "vertex_error_mm", "inside_percent", "deepest_mm", "edge_strain", "jerk_m_s3")
    return (
        {"clip": motion.name, "source": motion.source}
        | {name: figures[name] for name in names}
        | {"inside_by_libigl": counter.inside}
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", nargs="?", help="Dataset of the fit, whose test split is measured too.")
    options = parser.parse_args()
    cape = hemline.load("cape")
    body = hemline.bodies.load(cape.body_name).shaped()
    rows = [row(cape, body, hemline.motions.load(name)) for name in hemline.motions.names()]
    if options.dataset:
        dataset = hemline.datasets.open_dataset(options.dataset)
        for held_out in dataset.split("test"):
            motion = dataset.take(held_out).motion
            rows += [row(cape, body, motion, truth=dataset, drive=drive) for drive in ("truth", "own")]
    RESULTS.parent.mkdir(parents=True, exist_ok=True)
    with RESULTS.open("w") as stream:
        for each in rows:
            stream.write(json.dumps(each | {"machine": machine(), "commit": commit()}) + "\n")
            error = each["vertex_error_mm"]
            shown = f"{error['mean']:6.1f} mm mean {error['p95']:6.1f} p95" if error else " " * 27
            inside = each["inside_percent"]
            print(f"{each['clip']:<12} {each['drive']:<6} {each['frames']:>4} frames {shown}", end="  ")
            print(f"inside before {inside['before']:.3f} %, after {inside['after']:.3f} %", end=", ")
            print(f"by libigl {each['inside_by_libigl']}, pinched {inside['pinched']:.4f} %")


if __name__ == "__main__":
    main()
