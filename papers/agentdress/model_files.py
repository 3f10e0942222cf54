"""Model files of AgentDress against settled garments: `python .../agentdress/model_files.py TEST MODEL...`.

TEST is a folder for the test set of `errors.py`, made and continued here: the same pairs. Each MODEL is a name or a
file, all of one garment. Prints, for each, the mean error on random bodies and on the mean one, beside skinning, and
writes one JSON line each to benchmarks/results/agentdress_model_files.jsonl. `errors.py` fits anew, and says more.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from hemline import animators
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.bench.machine import commit, machine
from hemline.compiled import use_threads
from papers.agentdress.compared import on_random_bodies, on_the_mean_body
from papers.agentdress.pairs import settled_pairs

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "agentdress_model_files.jsonl"


def main() -> None:
    """Make what is missing of the test set, measure, print, record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("test", type=Path)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--pairs", type=int, default=400, help="poses, each with a random body")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    asked = parser.parse_args()
    use_threads(1)
    models = [animators.load(each) for each in asked.models]
    if not all(isinstance(each, AnimatorAgentDress) for each in models):
        raise SystemExit("AgentDress is measured here: name its models")
    garment = models[0].garment
    pairs = list(settled_pairs(asked.test, garment, count=asked.pairs, seed=asked.seed, jobs=asked.jobs))
    for name, model in zip(asked.models, models, strict=True):
        assert isinstance(model, AnimatorAgentDress)
        random, mean = on_random_bodies(model, pairs, {}), on_the_mean_body(model, pairs, {})
        row = {
            "model": Path(name).name,
            "garment": garment.name,
            "poses": model.figures["poses"],
            "mirrored_poses": model.figures.get("mirrored_poses", 0.0),
            "pairs": len(pairs),
            "random_bodies_mm": {key: round(float(np.mean(each)), 2) for key, each in random.items()},
            "mean_body_mm": {key: round(float(np.mean(each)), 2) for key, each in mean.items()},
            "machine": machine(),
            "commit": commit(),
        }
        print(json.dumps(row), flush=True)
        with RESULTS.open("a") as stream:
            stream.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
