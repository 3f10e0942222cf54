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
"""Options of its sizes, and `distance`, that of the descriptor."""
TERMS: dict[str, dict[str, float]] = {
    "vertices alone": {"edge": 0.0, "bend": 0.0, "gravity": 0.0, "collision": 0.0},
    "with the collision loss": {"edge": 0.0, "bend": 0.0, "gravity": 0.0},
    "with all terms": {},
}
"""The plain one gone on with: weights of its loss that are not the paper's."""
FRAMES, WARM_UP = 4, 50
"""Frames of a garment shown together; steps over which the learning rate rises."""


def names() -> list[str]:
    """Of all variants."""
    return [*GRAPH, *TERMS]


@dataclass(frozen=True)
class Budget:
    """How long each is trained, and where its checkpoints lie."""

    epochs: int
    more: int
    """Epochs of those of `TERMS`."""
    mark: str
    folder: Path

    def trained(self, name: str, samples: TakeSamples, config: EstimatorConfig, **options: Any) -> Any:
        """A variant, trained; from its checkpoint where it is there."""
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
    """Rows of those that are wanted.

    Args:
        samples: Takes to learn from and to judge by.
        betas: Shape coefficients of the body.
        budget: How long.
        wanted: Names.
    """
    plain = estimator_of(SwingarConfig(), betas)
    for name in [name for name in GRAPH if name in wanted]:
        options = GRAPH[name]
        config = replace(plain, **{key: value for key, value in options.items() if key != "distance"})
        shown = described(samples, config.descriptor, options.get("distance", "geodesic"))
        began = process_time()
        trained = budget.trained(name, shown, config)
        yield row(name, shown, config, trained, "coarse", process_time() - began)
    for name in [name for name in TERMS if name in wanted]:
        from hemline.animators.swingar.fit.losses import LossWeights

        start = budget.trained(PLAIN, samples, plain).arrays
        began = process_time()
        trained = budget.trained(name, samples, plain, start=start, weights=LossWeights(**TERMS[name]))
        yield row(name, samples, plain, trained, "coarse-all-terms", process_time() - began)


def row(name: str, shown: TakeSamples, config: EstimatorConfig, trained: Any, stage: str, seconds: float) -> dict:
    """What is kept of a variant."""
    curve = [1e3 * each for each in trained.curves[stage]]
    found = {"network": "graph", "variant": name, "skinned_mm": curve[0], "curve_mm": curve, "cpu_s": seconds}
    return found | judged(shown, config, trained.arrays)


def described(samples: TakeSamples, size: int, distance: Any) -> TakeSamples:
    """Samples with another descriptor."""
    found = []
    for each in samples.garments:
        points = each.features[:, 3:6]
        own = Descriptor.of(points, each.faces, size=min(size, len(points)), distance=distance)
        found.append(replace(each, descriptor=own.pad_to(size)))
    return replace(samples, garments=found)


def judged(samples: TakeSamples, config: EstimatorConfig, arrays: dict[str, np.ndarray]) -> dict[str, float]:
    """Errors on held-out frames, each garment on each body counting alike, and what is inside the body there."""
    import torch

    from hemline.animators.swingar.fit.estimator import Estimator
    from hemline.animators.swingar.fit.objectives import SUPERVISED, CoarseObjective, Groups, validation_frames

    estimator, sdf = Estimator(config), load_neural_sdf()
    estimator.load_state_dict({name: torch.from_numpy(each) for name, each in arrays.items()})
    groups = Groups(FRAMES)
    stage, rows = CoarseObjective(estimator, samples, groups, SUPERVISED), []
    for chosen in validation_frames(samples, groups):
        batch, garment = samples.frames(chosen), samples.garments[int(samples.garment_of[chosen[0]])]
        with torch.no_grad():
            found = stage.predicted(chosen, batch).numpy()
        apart = 1e3 * np.linalg.norm(found - batch.truth, axis=2)
        turned = [normal_errors_deg(*each, garment.faces) for each in zip(found, batch.truth, strict=True)]
        neighbours, shares = Neighbours.of(garment.features[:, 3:6], garment.faces), []
        for vertices, told in zip(found, batch.body, strict=True):
            posed = posed_as(told)
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


def posed_as(told: np.ndarray) -> PosedBody:
    """The body that the network is told of, as it sees it: the pelvis is the origin, its heading is taken out."""
    joints = 24
    shaped = bodies.load("anny24").shaped(told[: -3 * joints])
    rotations = from_axis_angle(told[-3 * joints :].reshape(joints, 3).astype(np.float64)).astype(np.float32)
    return shaped.posed(Pose(rotations, np.zeros(3, np.float32)))
