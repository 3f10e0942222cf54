"""Variants of the graph network, trained alike and judged: rows for `ablations.py`, which says how."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from hemline import bodies
from hemline.animators.coarse.features.descriptor import Descriptor
from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.estimator_config import EstimatorConfig
from hemline.animators.swingar.fit.fit_graph import estimator_of
from hemline.animators.swingar.fit.graph_samples import TakeSamples
from hemline.bodies import PosedBody
from hemline.collide import inside
from hemline.collide.neural_sdf.handling import Neighbours, push_out
from hemline.collide.neural_sdf.neural_sdf import load_neural_sdf
from hemline.files import content_hash
from hemline.metrics import normal_errors_deg
from hemline.motions.motion import Pose
from hemline.motions.quaternions import from_axis_angle

PLAIN = "as the paper, with lag features"
GRAPH: dict[str, dict[str, Any]] = {
    PLAIN: {},
    "no features, as printed": {"told": 0, "state_told": 0, "displacement": 0},
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
TERMS: dict[str, dict[str, float]] = {
    "vertices alone": {"edge": 0.0, "bend": 0.0, "gravity": 0.0, "collision": 0.0},
    "with the collision loss": {"edge": 0.0, "bend": 0.0, "gravity": 0.0},
    "with all terms": {},
    "with all terms, as the paper weights them": {"edge": 10.0, "bend": 3.0, "gravity": 0.2, "collision": 1.5},
}
"""Variants that continue from the plain network: the weights of the loss that are not those of `LossWeights`."""
FRAMES, WARM_UP = 4, 50
"""Number of frames of a garment in a batch; number of steps over which the learning rate rises."""


def names() -> list[str]:
    """Returns the names of all variants."""
    return [*GRAPH, *TERMS]


@dataclass(frozen=True)
class Budget:
    """Length of the trainings, and the folder of their checkpoints."""

    epochs: int
    """Epochs of the variants in `GRAPH`."""
    more: int
    """Epochs of the variants in `TERMS`."""
    mark: str
    """Hash of everything that the trainings depend on."""
    folder: Path
    """Folder for checkpoints."""

    def train(self, name: str, samples: TakeSamples, config: EstimatorConfig, **options: Any) -> Any:
        """Trains a variant, from its checkpoint if there is one."""
        from hemline.animators.swingar.fit.train_estimator import TrainingPlan, train_estimator

        epochs = {"coarse_epochs": 0, "term_epochs": self.more} if options else {"coarse_epochs": self.epochs}
        rest = {"term_epochs": 0, "corrective_epochs": 0, "patience": 0, "frames": FRAMES, "warm_up": WARM_UP}
        mark, folder = content_hash({"mark": self.mark, "name": name}), self.folder / name.replace(" ", "-")
        folder.mkdir(parents=True, exist_ok=True)
        return train_estimator(
            samples,
            config,
            TrainingPlan(**(rest | epochs)),
            seed=0,
            mark=mark,
            folder=folder,
            progress=lambda *_: None,
            **options,
        )


def rows_of_graph(samples: TakeSamples, betas: int, budget: Budget, wanted: set[str]) -> Iterator[dict[str, Any]]:
    """Yields rows of the wanted variants.

    Args:
        samples: Samples to train on and to evaluate on.
        betas: Number of shape coefficients of the body.
        budget: Length of the trainings.
        wanted: Names of the variants.
    """
    plain = estimator_of(SwingarConfig(), betas)
    for name in [name for name in GRAPH if name in wanted]:
        options = GRAPH[name]
        config = replace(plain, **{key: value for key, value in options.items() if key != "distance"})
        shown = describe_garments(samples, config.descriptor, options.get("distance", "geodesic"))
        began = process_time()
        trained = budget.train(name, shown, config)
        yield row(name, shown, config, trained, "coarse", process_time() - began)
    for name in [name for name in TERMS if name in wanted]:
        from hemline.animators.swingar.fit.losses import LossWeights

        start = budget.train(PLAIN, samples, plain).arrays
        began = process_time()
        trained = budget.train(name, samples, plain, start=start, weights=LossWeights(**TERMS[name]))
        yield row(name, samples, plain, trained, "coarse-all-terms", process_time() - began)


def row(name: str, shown: TakeSamples, config: EstimatorConfig, trained: Any, stage: str, seconds: float) -> dict:
    """Returns the row of a variant."""
    curve = [1e3 * each for each in trained.curves[stage]]
    found = {"network": "graph", "variant": name, "skinned_mm": curve[0], "curve_mm": curve, "cpu_s": seconds}
    return found | evaluate(shown, config, trained.arrays)


def describe_garments(samples: TakeSamples, size: int, distance: Any) -> TakeSamples:
    """Returns samples with another descriptor."""
    found = []
    for each in samples.garments:
        points = each.features[:, 3:6]
        own = Descriptor.of(points, each.faces, size=min(size, len(points)), distance=distance)
        found.append(replace(each, descriptor=own.pad_to(size)))
    return replace(samples, garments=found)


def evaluate(samples: TakeSamples, config: EstimatorConfig, arrays: dict[str, np.ndarray]) -> dict[str, float]:
    """Returns errors on held-out frames and vertices inside the body; garments on a body have equal weights."""
    import torch

    from hemline.animators.swingar.fit.estimator import Estimator
    from hemline.animators.swingar.fit.frame_tensors import FrameTensors
    from hemline.animators.swingar.fit.objectives import SUPERVISED, CoarseObjective, Groups, validation_frames

    estimator, sdf = Estimator(config), load_neural_sdf()
    estimator.load_state_dict({name: torch.from_numpy(each) for name, each in arrays.items()})
    groups = Groups(FRAMES)
    stage, rows = CoarseObjective(estimator, samples, groups, SUPERVISED), []
    for chosen in validation_frames(samples, groups):
        batch, garment = samples.frames(chosen), samples.garments[int(samples.garment_of[chosen[0]])]
        with torch.no_grad():
            found = stage.predict(chosen, FrameTensors.of(batch, torch.device("cpu"))).numpy()
        apart = 1e3 * np.linalg.norm(found - batch.truth, axis=2)
        turned = [normal_errors_deg(*each, garment.faces) for each in zip(found, batch.truth, strict=True)]
        neighbours, shares = Neighbours.of(garment.features[:, 3:6], garment.faces), []
        for vertices, inputs in zip(found, batch.body, strict=True):
            posed = pose_body(inputs)
            out = push_out(vertices, sdf.at(posed), neighbours).vertices
            shares.append([inside(posed.vertices, posed.faces, each).mean() for each in (vertices, out)])
        rows.append(
            {
                "error_mm": apart.mean(),
                "rmse_mm": np.sqrt((apart**2).mean()),
                "p95_mm": np.percentile(apart, 95),
                "normals_deg": np.nanmean(turned),
                "inside_percent": 100 * np.mean(shares, axis=0)[0],
                "handled_percent": 100 * np.mean(shares, axis=0)[1],
            }
        )
    return {key: float(np.mean([each[key] for each in rows])) for key in rows[0]}


def pose_body(inputs: np.ndarray) -> PosedBody:
    """Poses the body at the origin without heading, from its betas and axis-angles."""
    joints = 24
    shaped = bodies.load("anny24").shaped(inputs[: -3 * joints])
    rotations = from_axis_angle(inputs[-3 * joints :].reshape(joints, 3).astype(np.float64)).astype(np.float32)
    return shaped.posed(Pose(rotations, np.zeros(3, np.float32)))
