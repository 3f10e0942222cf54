"""Plays garments by rope chains where they hang and by AgentDress where they lie close: `python -m benchmarks.blends`.

For garments of `benchmarks.making` whose run fitted both methods, plays each method alone and both blended, on the clip
that neither was fitted to. The weight of a vertex is how much it hangs (`hemline.make.regions`), smoothed over the
mesh. Writes one JSON line for each garment to benchmarks/results/blends.jsonl.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.making import ROOT, model_file
from hemline import animators, bodies
from hemline.animators import Animator
from hemline.arrays import Float, Vertices
from hemline.bench.machine import commit, machine
from hemline.bodies import PosedBody, ShapedBody
from hemline.datasets import Dataset, open_dataset
from hemline.garments import Garment
from hemline.make.clips import CHECK_CLIP, clean_part
from hemline.make.regions import Regions
from hemline.make.trial import run_trial, truth_vertices
from hemline.meshes import edges
from hemline.motions import open_motion

RESULTS = ROOT / "benchmarks" / "results" / "blends.jsonl"
PASSES = 20
"""Number of passes that smooth the weights, each of which averages a vertex with its neighbours."""


@dataclass(frozen=True, eq=False)
class Blend:
    """An animator that shows the weighted mean of two others.

    Attributes:
        close: Animator of cloth that lies close.
        loose: Animator of cloth that hangs.
        weights: Weight of the second one at each vertex.
    """

    close: Animator
    loose: Animator
    weights: Float[np.ndarray, " verts"]
    name = "blend"
    figures: Any = None

    @property
    def garment(self) -> Garment:
        """The garment of both."""
        return self.close.garment

    @property
    def body_name(self) -> str:
        """Name of the body of both."""
        return self.close.body_name

    @property
    def body_hash(self) -> str:
        """Hash of the body of both."""
        return self.close.body_hash

    def start(self, posed: PosedBody) -> tuple[Any, Any]:
        """Returns the States of both."""
        return self.close.start(posed), self.loose.start(posed)

    def step(self, state: tuple[Any, Any], posed: PosedBody, dt: float) -> tuple[tuple[Any, Any], Vertices]:
        """Advances both; returns their States and the weighted mean of their vertices (verts, 3) [m]."""
        close, one = self.close.step(state[0], posed, dt)
        loose, other = self.loose.step(state[1], posed, dt)
        share = self.weights[:, None].astype(np.float32)
        return (close, loose), (1 - share) * one + share * other

    def save(self, path: str | Path) -> None:
        """Does nothing: a trial is not saved."""


def smooth_weights(check: Dataset, probe: Dataset, body: ShapedBody) -> tuple[Float[np.ndarray, " verts"], float]:
    """Returns how much each vertex hangs, smoothed over the mesh, and the fraction of the area that hangs."""
    garment = check.garment
    (row,) = probe.clips()
    regions = Regions.of(probe.take(row), check.rest(garment.body_betas).vertices[0], garment.faces, body)
    pairs, weights = edges(garment.faces), regions.hanging
    degree = np.bincount(pairs.ravel(), minlength=len(weights))
    for _ in range(PASSES):
        around = np.bincount(pairs[:, 0], weights[pairs[:, 1]], len(weights))
        around += np.bincount(pairs[:, 1], weights[pairs[:, 0]], len(weights))
        weights = 0.5 * weights + 0.5 * around / np.maximum(degree, 1)
    return weights, regions.hanging_fraction


def measure(name: str, minutes: float) -> dict[str, Any]:
    """Returns the line of a garment."""
    folder = model_file(name, minutes).with_suffix(".making")
    close, loose, live = (
        animators.load(folder / "candidates" / f"{each}.safetensors") for each in ("agentdress", "ropes", "live")
    )
    check, body = open_dataset(folder / "check"), bodies.load(close.body_name).shaped()
    motion = clean_part(open_motion(CHECK_CLIP))
    motion = motion[: len(truth_vertices(check, motion))]
    weights, hanging = smooth_weights(check, open_dataset(folder / "probe"), body)

    def trial(animator: Animator) -> Any:
        return run_trial(animator, body, motion, check, 0.0).trial

    row: dict[str, Any] = {"name": name, "minutes": minutes, "hanging": hanging}
    tried = {"agentdress": close, "ropes": loose, "blend": Blend(close, loose, weights)}
    row |= {title: trial(animator).entries() for title, animator in tried.items()}
    return row | {"live_mm": trial(live).error_mm, "machine": machine(), "commit": commit()}


def main() -> None:
    """Measures the garments that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="+", help="Garments of the wardrobe.")
    parser.add_argument("--minutes", type=float, default=60.0, help="Length of the runs that made their models [min].")
    options = parser.parse_args()
    for name in options.names:
        row = measure(name, options.minutes)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row) + "\n")
        print(name, *(f"{key} {row[key]['error_mm']:.1f} mm" for key in ("agentdress", "ropes", "blend")))


if __name__ == "__main__":
    main()
