"""Model files of AgentDress against settled garments: `python -m papers.agentdress.model_files TEST MODEL...`.

TEST is the folder of the test set of `errors.py`, made and continued here. Each MODEL is a model file or the name of a
shipped model, all of one garment. Adds a row per model to benchmarks/results/agentdress_model_files.jsonl, with the
mean errors on random bodies and on the mean one; `errors.py` fits anew and measures more.
"""

from pathlib import Path

import numpy as np

from hemline import animators
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.compiled import use_threads
from papers.agentdress.models.ablations import errors_on_mean_body, errors_on_random_bodies
from papers.agentdress.settled.pairs import settle_pairs
from papers.report import parse_options, record

NAME = "agentdress_model_files"


def main() -> None:
    """Settles what the test set lacks, measures and records."""
    options = parse_options(
        __doc__, "test", "models...", pairs=(400, "number of poses, each with a random body"), seed=0, jobs=1
    )
    use_threads(1)
    models = {name: animators.load(name) for name in options.models}
    if not all(isinstance(each, AnimatorAgentDress) for each in models.values()):
        raise SystemExit("only AgentDress is measured here: name its models")
    garment = models[options.models[0]].garment
    pairs = list(settle_pairs(options.test, garment, count=options.pairs, seed=options.seed, jobs=options.jobs))
    for name, model in models.items():
        assert isinstance(model, AnimatorAgentDress)
        random, mean = errors_on_random_bodies(model, pairs, {}), errors_on_mean_body(model, pairs, {})
        row = {
            "model": Path(name).name,
            "garment": garment.name,
            "poses": model.figures["poses"],
            "mirrored_poses": model.figures.get("mirrored_poses", 0.0),
            "pairs": len(pairs),
            "random_bodies_mm": {key: round(float(np.mean(each)), 2) for key, each in random.items()},
            "mean_body_mm": {key: round(float(np.mean(each)), 2) for key, each in mean.items()},
        }
        print(record(NAME, row), flush=True)


if __name__ == "__main__":
    main()
