"""What goes beyond the paper, each beside what it would replace: `python .../agentdress/beyond.py ANCHORS TEST`.

ANCHORS is what `hemline drape GARMENT --anchors ...` made, TEST the test set of `errors.py`. Sensitivities of the
body's own shape, and a kernel over pose and shape together, are judged beside what ships; so are the paper's
sensitivities (with what skinning does), bodies compared by their betas instead of the skin under the garment, and a fit
without the random bodies. Rows of `materials.py` stand beside them.

One JSON line goes to benchmarks/results/agentdress_beyond.jsonl; the page papers/agentdress/pages/beyond.md is written anew.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np

from hemline import bodies
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet, is_t_pose
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.agentdress.shape_model import shape_features, pad_betas
from hemline.bench.machine import commit, machine
from hemline.bodies.velocities import turning
from hemline.compiled import use_threads
from hemline.datasets import Dataset, open_dataset
from hemline.datasets.joint_sensitivity import derivatives_by_joint
from papers.agentdress.beyond_page import write_page
from papers.agentdress.joint_kernel import shape_errors
from papers.agentdress.pairs import Pair, settled_pairs

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "agentdress_beyond.jsonl"
RIDGE = 0.2


def sensitivities(dataset: Dataset, anchors: AnchorSet) -> tuple[np.ndarray, np.ndarray]:
    """Betas of the bodies in the T-pose, and how far each vertex moves there beside the skin when a joint turns."""
    body, betas, found = bodies.load(dataset.garment.body_name), [], []
    for row in dataset.anchors():
        take = dataset.take(row)
        if "turn.0.0" not in take.derivatives or not is_t_pose(take.motion[0]):
            continue
        moved, posed = derivatives_by_joint(take), body.shaped(take.betas).posed(take.motion[0])
        skinned = [
            [turning(posed, joint, axis)[anchors.binding.nearest] for axis in np.eye(3)] for joint in range(len(moved))
        ]
        found.append(np.linalg.norm(moved - np.array(skinned), axis=3).transpose(2, 0, 1))
        betas.append(take.betas)
    return pad_betas(np.array(betas, np.float64), anchors.betas.shape[1]), np.array(found)


def of_own_shape(
    dataset: Dataset, anchors: AnchorSet, pairs: list[Pair]
) -> dict[tuple[float, ...], AnimatorAgentDress]:
    """A fit for each body, with the sensitivities of its shape: a ridge regression on the betas and their squares."""
    betas, norms = sensitivities(dataset, anchors)
    features, made = shape_features(betas), {}
    centre, mean = features.mean(axis=0), norms.mean(axis=0)
    away = features - centre
    weights = np.linalg.solve(
        away.T @ away + RIDGE * np.eye(away.shape[1]), away.T @ (norms - mean).reshape(len(norms), -1)
    )
    for shape in {pair.betas for pair in pairs}:
        query = shape_features(pad_betas(np.array([shape]), betas.shape[1]))
        told = np.maximum(mean + ((query - centre) @ weights).reshape(mean.shape), 0)
        some = replace(anchors, sensitivity=(anchors.sensitivity[0], told))
        made[shape] = _fitted(dataset, some)
    return made


def without_random_bodies(dataset: Dataset, anchors: AnchorSet) -> AnimatorAgentDress:
    """A fit that knows the betas of the anchors alone."""
    known = anchors.betas.shape[1]

    class Fewer(Dataset):
        def anchors(self):
            return [row for row in super().anchors() if not any(row.betas[known:])]

    fewer = Fewer(dataset.folder, dataset.garment)
    return _fitted(dataset, AnchorSet.of(fewer))


def _fitted(
    dataset: Dataset, anchors: AnchorSet, config: AgentDressConfig | None = None, scale: np.ndarray | None = None
) -> AnimatorAgentDress:
    options = config or AgentDressConfig()
    return fit_anchors(dataset.garment, anchors, options, scale=scale, progress=lambda stage, done, total: None)


def error_mm(model_of, pairs: list[Pair], body: bodies.Body) -> float:
    """Mean distance of vertices to the settled garment over the pairs."""
    missed = [
        np.linalg.norm(model_of(pair).settled(body.shaped(pair.betas).posed(pair.pose)) - pair.worn, axis=1).mean()
        for pair in pairs
    ]
    return 1e3 * float(np.mean(missed))


def main() -> None:
    """Fit, measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("anchors", type=Path)
    parser.add_argument("test", type=Path)
    parser.add_argument("--pairs", type=int, default=400, help="as errors.py was told")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    use_threads(1)
    dataset = open_dataset(asked.anchors)
    anchors, body = AnchorSet.of(dataset), bodies.load(dataset.garment.body_name)
    pairs = list(settled_pairs(asked.test, dataset.garment, count=asked.pairs, seed=asked.seed, jobs=1))
    model, own = _fitted(dataset, anchors), of_own_shape(dataset, anchors, pairs)
    whole = _fitted(dataset, replace(anchors, sensitivity=(anchors.sensitivity[0],) * 2))
    fewer = without_random_bodies(dataset, anchors)
    blended = _fitted(dataset, anchors, AgentDressConfig(shape_model="blended"))
    alike = _fitted(dataset, anchors, scale=np.eye(len(body.shapedirs)))
    row = {
        "garment": dataset.garment.name,
        "anchors": len(anchors.rotations),
        "pairs": len(pairs),
        "random_bodies_mm": {
            "as it ships": error_mm(lambda pair: model, pairs, body),
            "shape models of five anchors, blended (Eq. 4)": error_mm(lambda pair: blended, pairs, body),
            "bodies compared by betas alike": error_mm(lambda pair: alike, pairs, body),
            "sensitivities of the body's own shape": error_mm(lambda pair: own[pair.betas], pairs, body),
            "sensitivities with what skinning does (the paper's)": error_mm(lambda pair: whole, pairs, body),
            "without random bodies in the fit": error_mm(lambda pair: fewer, pairs, body),
        },
        "shape_left_out_mm": shape_errors(model, anchors),
        "machine": machine(),
        "commit": commit(),
    }
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")
    print(write_page(row))


if __name__ == "__main__":
    main()
