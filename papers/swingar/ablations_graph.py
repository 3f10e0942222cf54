"""Variants of the graph network, trained alike and judged: rows for `ablations.py`, which says how."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import torch

from hemline import bodies
from hemline.animators.coarse.features.descriptor import Descriptor
from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.estimator_config import EstimatorConfig, weight_shapes
from hemline.animators.swingar.fit.estimator import Estimator
from hemline.animators.swingar.fit.fit_graph import estimator_of
from hemline.animators.swingar.fit.frame_reader import FrameReader
from hemline.animators.swingar.fit.frame_tensors import FrameTensors
from hemline.animators.swingar.fit.graph_samples import TakeSamples
from hemline.animators.swingar.fit.losses import LossWeights
from hemline.animators.swingar.fit.objectives import SUPERVISED, CoarseObjective, Groups, validation_frames
from hemline.animators.swingar.fit.train_estimator import Trained, TrainingPlan, train_estimator
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
JUDGED = Groups(validation=12, garments=80, mirrored=False)
"""Frames that variants are evaluated on: of each garment on a body, and the most garments."""
CORRECTED = 3
"""Interval between the evaluated frames whose vertices inside the body are counted."""
LAYERS = ("graph_first", "graph_second", "state", "blend_first", "blend_second")
"""Attention layers of the coarse predictor."""


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
    plan: TrainingPlan
    """Batches, learning rate and device of all trainings; its numbers of epochs are not used."""
    seeds: tuple[int, ...]
    """Seeds; each variant is trained once with each of them."""
    mark: str
    """Hash of everything that the trainings depend on."""
    folder: Path
    """Folder for checkpoints."""

    def train(self, name: str, seed: int, samples: TakeSamples, config: EstimatorConfig, **options: Any) -> Trained:
        """Trains a variant, from its checkpoint if there is one."""
        terms = {"coarse_epochs": 0, "term_epochs": self.more} if options else {"coarse_epochs": self.epochs}
        mark = content_hash({"mark": self.mark, "name": name, "seed": seed})
        folder = self.folder / f"{name.replace(' ', '-')}-{seed}"
        folder.mkdir(parents=True, exist_ok=True)
        return train_estimator(
            samples,
            config,
            replace(self.plan, **({"term_epochs": 0, "corrective_epochs": 0, "patience": 0} | terms)),
            seed=seed,
            mark=mark,
            folder=folder,
            progress=lambda *_: None,
            scales=samples.scales() if config.told else None,
            **options,
        )


def rows_of_graph(
    samples: TakeSamples, judged: TakeSamples, betas: int, budget: Budget, wanted: set[str]
) -> Iterator[dict[str, Any]]:
    """Yields rows of the wanted variants.

    Args:
        samples: Samples to train on, and to choose the best epoch by.
        judged: Samples to evaluate on, those of its validation set.
        betas: Number of shape coefficients of the body.
        budget: Length of the trainings.
        wanted: Names of the variants.
    """
    plain = estimator_of(SwingarConfig(), betas)
    for name, seed in product([name for name in GRAPH if name in wanted], budget.seeds):
        options = GRAPH[name]
        config = replace(plain, **{key: value for key, value in options.items() if key != "distance"})
        distance = options.get("distance", "geodesic")
        learned, shown = (describe_garments(each, config.descriptor, distance) for each in (samples, judged))
        trained = budget.train(name, seed, learned, config)
        yield row(name, seed, shown, config, trained, "coarse", budget.plan)
    for name, seed in product([name for name in TERMS if name in wanted], budget.seeds):
        start = budget.train(PLAIN, seed, samples, plain).arrays
        trained = budget.train(name, seed, samples, plain, start=start, weights=LossWeights(**TERMS[name]))
        yield row(name, seed, judged, plain, trained, "coarse-all-terms", budget.plan)


def row(
    name: str, seed: int, shown: TakeSamples, config: EstimatorConfig, trained: Trained, stage: str, plan: TrainingPlan
) -> dict[str, Any]:
    """Returns the row of a variant."""
    curve = [1e3 * each for each in trained.curves[stage]]
    found = {"network": "graph", "variant": name, "seed": seed, "chosen_mm": min(curve), "curve_mm": curve}
    found |= {"attention_moved_percent": 100 * attention_moved(config, seed, trained.arrays)}
    return found | evaluate(shown, config, trained.arrays, plan)


def attention_moved(config: EstimatorConfig, seed: int, arrays: dict[str, np.ndarray]) -> float:
    """Returns how far training moved the vectors of all attention scores, relative to their length at the start."""
    torch.manual_seed(seed)
    start = Estimator(config).state_dict()
    vectors = [name for name in weight_shapes(config) if name.endswith(".vectors") and name.partition(".")[0] in LAYERS]
    before = np.concatenate([start[name].numpy().ravel() for name in vectors])
    after = np.concatenate([arrays[name].ravel() for name in vectors])
    return float(np.linalg.norm(after - before) / np.linalg.norm(before))


def describe_garments(samples: TakeSamples, size: int, distance: Any) -> TakeSamples:
    """Returns samples with another descriptor."""
    found = []
    for each in samples.garments:
        points = each.features[:, 3:6]
        own = Descriptor.of(points, each.faces, size=min(size, len(points)), distance=distance)
        found.append(replace(each, descriptor=own.pad_to(size)))
    return replace(samples, garments=found)


def evaluate(
    samples: TakeSamples, config: EstimatorConfig, arrays: dict[str, np.ndarray], plan: TrainingPlan
) -> dict[str, float]:
    """Returns errors on held-out frames and vertices inside the body; garments on a body have equal weights."""
    device, sdf = torch.device(plan.device), load_neural_sdf()
    estimator = Estimator(config).to(device)
    estimator.load_state_dict({name: torch.from_numpy(each) for name, each in arrays.items()})
    stage, rows = CoarseObjective(estimator, samples, JUDGED, SUPERVISED, FrameReader(samples, device, room=0)), []
    for chosen in validation_frames(samples, JUDGED):
        batch, garment = samples.frames(chosen), samples.garments[int(samples.garment_of[chosen[0]])]
        with torch.no_grad():
            found = stage.predict(chosen, FrameTensors.of(batch, device)).cpu().numpy()
        apart = 1e3 * np.linalg.norm(found - batch.truth, axis=2)
        turned = [normal_errors_deg(*each, garment.faces) for each in zip(found, batch.truth, strict=True)]
        neighbours, shares = Neighbours.of(garment.features[:, 3:6], garment.faces), []
        for vertices, inputs in zip(found[::CORRECTED], batch.body[::CORRECTED], strict=True):
            posed = pose_body(inputs)
            out = push_out(vertices, sdf.at(posed), neighbours).vertices
            shares.append([inside(posed.vertices, posed.faces, each).mean() for each in (vertices, out)])
        skinned = samples.skinning_error(chosen)
        rows.append(
            {
                "error_mm": apart.mean(),
                "skinned_mm": 1e3 * skinned,
                "rmse_mm": np.sqrt((apart**2).mean()),
                "p95_mm": np.percentile(apart, 95),
                "normals_deg": np.nanmean(turned),
                "inside_percent": 100 * np.mean(shares, axis=0)[0],
                "handled_percent": 100 * np.mean(shares, axis=0)[1],
            }
        )
    found = {key: float(np.mean([each[key] for each in rows])) for key in rows[0]}
    return found | {"judged_groups": len(rows)}


def pose_body(inputs: np.ndarray) -> PosedBody:
    """Poses the body at the origin without heading, from its betas and axis-angles."""
    joints = 24
    shaped = bodies.load("anny24").shaped(inputs[: -3 * joints])
    rotations = from_axis_angle(inputs[-3 * joints :].reshape(joints, 3).astype(np.float64)).astype(np.float32)
    return shaped.posed(Pose(rotations, np.zeros(3, np.float32)))
