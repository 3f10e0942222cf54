"""How bodies are compared, and how many a fit needs: `python -m papers.agentdress.bodies_apart MODEL...`.

Each MODEL is a model file or the name of a shipped model with a kernel as shape model. The training data of such a
regression follow from its weights, multiplied by its regularised kernel matrix. They are fitted again, with bodies
compared by their betas and by the skin under the garment with several powers (`shape_distance`). All drapes of every
fifth pose are left out; the error of their changes by the shape is measured with all bodies in the other poses, and
with the first few of them.

Adds a row per model to benchmarks/results/agentdress_bodies_apart.jsonl, with mean distances of vertices [mm].
"""

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
from papers.report import parse_options, record

NAME = "agentdress_bodies_apart"
POWERS = (0.5, 0.65, 0.75, 1.0)
COUNTS = (0, 40, 80, 160)
FOLDS = 5
ANCHOR_BETAS = 4
"""Number of betas of the bodies of anchors; random bodies have more."""


@dataclass(frozen=True)
class TrainingData:
    """The training data of a model.

    Attributes:
        model: The model.
        distances: Squared distances between its poses, per region.
        outputs: Change of each body from the mean shape, as coefficients of the basis [m].
    """

    model: AnimatorAgentDress
    distances: Float[np.ndarray, "poses regions poses"]
    outputs: Float[np.ndarray, "samples modes"]

    @classmethod
    def of(cls, model: AnimatorAgentDress) -> Self:
        """Recovers the training data from the weights of a model, as the mean over its regions, which shared them."""
        tables, shapes = model.tables, model.tables.shapes
        rotations, axes = tables.rotations.astype(np.float64), tables.axes.astype(np.float64)
        distances = region_distances(axes_between(rotations, rotations), axes)
        coordinates = shapes.betas.astype(np.float64) @ shapes.scale
        rows, between = (
            np.ix_(shapes.poses, shapes.poses),
            kernel_over_shapes(coordinates, coordinates, shapes.length_scale),
        )
        ridge = model.figures["shape_kernel_ridge"] * np.eye(len(coordinates))
        outputs = [
            (kernel(distances[:, region], model.shape_width)[rows] * between + ridge) @ weights.astype(np.float64)
            for region, weights in enumerate(shapes.weights)
        ]
        if len(outputs) < distances.shape[1] or np.std(outputs, axis=0).max() > 0.02 * np.abs(outputs).max():
            raise SystemExit(f"{model.garment.name}: the regions of this model were not fitted to the same drapes")
        return cls(model, distances, np.mean(outputs, axis=0))

    def error_mm(
        self, scale: Float[np.ndarray, "betas betas"], train: Int[np.ndarray, " some"], test: Int[np.ndarray, " others"]
    ) -> float:
        """Returns the error of a fit to some bodies on others, with the width and ridge of the model [mm]."""
        tables, options = self.model.tables, {"width": self.model.shape_width}
        poses, coordinates = tables.shapes.poses.astype(int), tables.shapes.betas.astype(np.float64) @ scale
        training = ShapeChanges(poses[train], coordinates[train], self.outputs[train], poses[train])
        fit = fit_shape_kernel(self.distances, training, **options, ridge=self.model.figures["shape_kernel_ridge"])
        between = kernel_over_shapes(coordinates, coordinates, SHAPE_LENGTH_SCALE)[test][:, train]
        residuals = []
        for region, weights in enumerate(fit.weights):
            over_poses = kernel(self.distances[:, region], options["width"])[np.ix_(poses[test], poses[train])]
            residuals.append(self.outputs[test] - (over_poses * between) @ weights)
        basis = tables.basis.unpack().astype(np.float64)[tables.pose_weights.shape[2] :]
        return leave_one_out_mm(np.array(residuals), basis, tables.regions.astype(np.float64))


def measure(data: TrainingData) -> dict[str, dict[str, float]]:
    """Returns errors by power of the comparison, and by number of random bodies [mm]."""
    model, shapes = data.model, data.model.tables.shapes
    fold = shapes.poses // (2 if model.figures.get("mirrored_poses") else 1) % FOLDS == 0
    random = np.abs(shapes.betas[:, ANCHOR_BETAS:]).max(axis=1) > 0
    test, others, anchors = (np.flatnonzero(each) for each in (fold & random, ~fold & random, ~fold & ~random))
    shaped = bodies.load(model.body_name).shaped(model.garment.body_betas)
    scales = {"betas": np.eye(shapes.betas.shape[1])}
    scales |= {f"skin, {power:g}": shape_scale(shaped, model.tables.nearest, power) for power in POWERS}
    order = np.random.default_rng(0).permutation(others)

    def error(scale: np.ndarray, count: int) -> float:
        return round(data.error_mm(scale, np.sort(np.concatenate([anchors, order[:count]])), test), 2)

    by_count = {
        f"{min(count, len(order))}: {name}": error(scales[name], count)
        for count in (*COUNTS, len(order))
        for name in ("betas", "skin, 0.75")
    }
    return {"power_mm": {name: error(scale, len(order)) for name, scale in scales.items()}, "bodies_mm": by_count}


def main() -> None:
    """Measures and records."""
    for name in parse_options(__doc__, "models...").models:
        model = animators.load(name)
        if not isinstance(model, AnimatorAgentDress):
            raise SystemExit("only AgentDress is measured here: name its models")
        print(record(NAME, {"model": Path(name).name} | measure(TrainingData.of(model))), flush=True)


if __name__ == "__main__":
    main()
