"""Which poses to settle a garment in: `python -m papers.agentdress.sampling MODEL ANCHORS`.

MODEL is a file or the name of a shipped model, ANCHORS the dataset that it was fitted to, with derivatives
(`hemline drape --derivatives`). Sensitivity-optimised rigging is given so many of the poses that have derivatives, as
examples: chosen by weighted k-means (ours), one after the other where the force that is left on the guessed garment is
largest (SOR's own sampling), and at random. Each choice is judged on the poses that have no derivatives.

One JSON line goes to benchmarks/results/agentdress_sampling.jsonl; the page papers/agentdress/pages/sampling.md and its picture
are made anew.
"""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

import hemline
from hemline.animators.agentdress.fit.anchor_set import AnchorSet, is_t_pose
from hemline.arrays import Float
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from hemline.datasets import open_dataset
from hemline.datasets.joint_sensitivity import joint_weights, mean_sensitivity
from hemline.motions.motion import Pose
from hemline.motions.pose_clusters import cluster_poses
from papers.agentdress.rigged_examples import STIFFNESS, Chosen, Examples, rigged_at
from papers.agentdress.sampling_page import write

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "benchmarks" / "results" / "agentdress_sampling.jsonl"
SIZES = (1, 5, 10, 20, 40)


def greedy(missed: Callable[[Chosen], Float[np.ndarray, " candidates"]], first: int, count: int) -> Chosen:
    """Candidates one after the other, each where the ones before miss most.

    Args:
        missed: From the chosen ones to what is missed at each candidate.
        first: The first one.
        count: How many in all.
    """
    chosen = [first]
    while len(chosen) < count:
        left = missed(np.array(chosen)).copy()
        left[chosen] = -np.inf
        chosen.append(int(left.argmax()))
    return np.array(chosen)


def clustered(rotations: Float[np.ndarray, "poses joints 4"], weights: np.ndarray, count: int, seed: int) -> Chosen:
    """The poses in the middle of so many clusters."""
    return np.array([each[0] for each in cluster_poses(rotations, weights, count, seed=seed).members])


def main() -> None:
    """Choose, judge, print, record, draw."""
    parser = argparse.ArgumentParser(description="Which poses to settle a garment in.")
    parser.add_argument("model")
    parser.add_argument("anchors", type=Path)
    parser.add_argument("--draws", type=int, default=3, help="random choices, and starts of k-means")
    parser.add_argument("--every", type=int, default=1, help="of the other poses, so many-th is judged on")
    asked = parser.parse_args()
    use_threads(1)
    model, dataset = hemline.load(asked.model), open_dataset(asked.anchors)
    rigged = rigged_at(dataset, model, AnchorSet.of(dataset))
    takes = [dataset.take(row) for row in dataset.anchors() if not any(row.betas)]
    upright = [take for take in takes if "turn.0.0" in take.derivatives and is_t_pose(take.motion[0])]
    weights = joint_weights(mean_sensitivity(upright))
    known = {take.motion[0].hash for take in takes if "turn.0.0" in take.derivatives}
    others = [take for take in takes if take.motion[0].hash not in known][:: asked.every]
    print(f"{len(rigged.rotations)} examples, judged on {len(others)} poses", file=sys.stderr, flush=True)
    rest = rigged.shaped.rest_pose.translation
    inner = Examples(model, rigged, [Pose(each.astype(np.float32), rest) for each in rigged.rotations])
    outer = Examples(model, rigged, [take.motion[0] for take in others])
    simulated = [outer.left(number, take.vertices[0]) for number, take in enumerate(others)]
    sizes = [size for size in SIZES if size < len(rigged.rotations)]
    random = np.random.default_rng(0)
    first = int(clustered(rigged.rotations, weights, 1, 0)[0])
    ordered = greedy(inner.norms, first, max(sizes))
    print("greedy order", ordered.tolist(), file=sys.stderr, flush=True)
    found: dict[str, dict[int, dict[str, float]]] = {}
    for size in sizes:
        choices = {
            "k-means": [clustered(rigged.rotations, weights, size, seed) for seed in range(asked.draws)],
            "greedy": [ordered[:size]],
            "random": [random.permutation(len(rigged.rotations))[:size] for _ in range(asked.draws)],
        }
        for name, each in choices.items():
            left, apart = [], []
            for chosen in each:
                for number, take in enumerate(others):
                    worn = outer.guessed(number, chosen)
                    left.append(outer.left(number, worn))
                    apart.append(1e3 * float(np.linalg.norm(worn - take.vertices[0], axis=1).mean()))
            found.setdefault(name, {})[size] = {
                "residual_n": float(np.mean(left, axis=0)[0]),
                "residual_weights": float(np.mean(left, axis=0)[1]),
                "error_mm": float(np.mean(apart)),
            }
            print(f"{size:>3} {name:<8} " + "  ".join(f"{k} {v:.2f}" for k, v in found[name][size].items()), flush=True)
    row = {
        "garment": model.garment.name,
        "examples": len(rigged.rotations),
        "judged_on": len(others),
        "stiffness": STIFFNESS,
        "draws": asked.draws,
        "found": found,
        "simulated_residual_n": float(np.mean(simulated, axis=0)[0]),
        "simulated_residual_weights": float(np.mean(simulated, axis=0)[1]),
        "machine": machine(),
        "threads": 1,
        "commit": commit(),
    }
    with RESULTS.open("a") as stream:
        stream.write(json.dumps(row) + "\n")
    write(row)


if __name__ == "__main__":
    main()
