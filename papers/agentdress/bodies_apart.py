"""How bodies are compared, and how many a fit wants: `python -m papers.agentdress.bodies_apart MODEL...`.

Each MODEL is a name or a file whose shapes are told by a kernel. Such a regression holds what it was fitted to: its
weights, times its own kernel matrix with the ridge. That is fitted anew, bodies compared by their betas, and by the
skin under the garment with several powers (`shape_distance`). Of every fifth pose all drapes are left out; what shapes
change in those is judged, with all bodies in the other poses and with the first few of them.

Prints mean distances of vertices [mm], and writes one JSON line each to
benchmarks/results/agentdress_bodies_apart.jsonl.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from hemline import animators, bodies
from hemline.animators.agentdress.distances import axes_between, region_distances
from hemline.animators.agentdress.fit.leave_one_out import leave_one_out_mm
from hemline.animators.agentdress.fit.shape_distance import shape_scale
from hemline.animators.agentdress.fit.shape_kernel import ShapeChanges, fit_shape_kernel
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_samples import SHAPE_LENGTH_SCALE, kernel_over_shapes
from hemline.arrays import Float, Int
from hemline.bench.machine import commit, machine

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "agentdress_bodies_apart.jsonl"
POWERS = (0.5, 0.65, 0.75, 1.0)
COUNTS = (0, 40, 80, 160)
FOLDS = 5
KNOWN = 4
"""Betas of the bodies that all anchors are settled on; a random one has more."""


@dataclass(frozen=True)
class Held:
    """What a model was fitted to.

    Attributes:
        model: The model.
        apart: Between its poses, squared, in each region.
        outputs: What each body adds, as coefficients of the basis [m].
    """

    model: AnimatorAgentDress
    apart: Float[np.ndarray, "poses regions poses"]
    outputs: Float[np.ndarray, "samples modes"]

    @classmethod
    def by(cls, model: AnimatorAgentDress) -> Self:
        """Read from the weights of a model; the mean over the regions, which were all fitted to the same."""
        tables, shapes = model.tables, model.tables.shapes
        rotations, axes = tables.rotations.astype(np.float64), tables.axes.astype(np.float64)
        apart = region_distances(axes_between(rotations, rotations), axes)
        where = shapes.betas.astype(np.float64) @ shapes.scale
        near, between = np.ix_(shapes.poses, shapes.poses), kernel_over_shapes(where, where, shapes.length_scale)
        ridge = model.figures["shape_kernel_ridge"] * np.eye(len(where))
        found = [
            (kernel(apart[:, region], model.shape_width)[near] * between + ridge) @ weights.astype(np.float64)
            for region, weights in enumerate(shapes.weights)
        ]
        if len(found) < apart.shape[1] or np.std(found, axis=0).max() > 0.02 * np.abs(found).max():
            raise SystemExit(f"{model.garment.name}: the regions of this model were not fitted to the same drapes")
        return cls(model, apart, np.mean(found, axis=0))

    def missed_mm(
        self, scale: Float[np.ndarray, "betas betas"], train: Int[np.ndarray, " some"], test: Int[np.ndarray, " others"]
    ) -> float:
        """What a fit to some bodies misses of others [mm], with the width and the ridge of the model."""
        tables, figures = self.model.tables, self.model.figures
        poses, where = tables.shapes.poses.astype(int), tables.shapes.betas.astype(np.float64) @ scale
        given = ShapeChanges(poses[train], where[train], self.outputs[train], poses[train])
        options = {"width": self.model.shape_width, "ridge": figures["shape_kernel_ridge"]}
        weights, between = fit_shape_kernel(self.apart, given, **options).weights, kernel_over_shapes(where, where, SHAPE_LENGTH_SCALE)
        missed = [
            self.outputs[test]
            - (
                kernel(self.apart[:, region], options["width"])[np.ix_(poses[test], poses[train])]
                * between[test][:, train]
            )
            @ each
            for region, each in enumerate(weights)
        ]
        basis = tables.basis.unpacked().astype(np.float64)[tables.pose_weights.shape[2] :]
        return leave_one_out_mm(np.array(missed), basis, tables.regions.astype(np.float64))


def measured(held: Held) -> dict[str, dict[str, float]]:
    """What is missed by the power of the comparison, and by the number of random bodies [mm]."""
    model, shapes = held.model, held.model.tables.shapes
    folds = shapes.poses // (2 if model.figures.get("mirrored_poses") else 1) % FOLDS == 0
    random = np.abs(shapes.betas[:, KNOWN:]).max(axis=1) > 0
    test, others, anchors = (np.flatnonzero(each) for each in (folds & random, ~folds & random, ~folds & ~random))
    shaped = bodies.load(model.body_name).shaped(model.garment.body_betas)
    scales = {"betas": np.eye(shapes.betas.shape[1])}
    scales |= {f"skin, {power:g}": shape_scale(shaped, model.tables.nearest, power) for power in POWERS}
    order = np.random.default_rng(0).permutation(others)

    def missed(scale: np.ndarray, count: int) -> float:
        return round(held.missed_mm(scale, np.sort(np.concatenate([anchors, order[:count]])), test), 2)

    by_count = {
        f"{min(count, len(order))}: {name}": missed(scales[name], count)
        for count in (*COUNTS, len(order))
        for name in ("betas", "skin, 0.75")
    }
    return {"power_mm": {name: missed(scale, len(order)) for name, scale in scales.items()}, "bodies_mm": by_count}


def main() -> None:
    """Measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="+")
    for name in parser.parse_args().models:
        model = animators.load(name)
        if not isinstance(model, AnimatorAgentDress):
            raise SystemExit("AgentDress is measured here: name its models")
        row = {"model": Path(name).name} | measured(Held.by(model)) | {"machine": machine(), "commit": commit()}
        print(json.dumps(row), flush=True)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
