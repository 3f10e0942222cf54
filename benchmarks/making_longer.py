"""Compares models that `hemline make` made in different times: `python -m benchmarks.making_longer [NAME ...]`.

A longer run compares its methods on a longer clip, so the figures of two runs differ by their clips as well. Here the
model of each run is played on the clip of the longest run, beside its simulation. The models and simulations are those
that `python -m benchmarks.making` left in out/making. One JSON line for each model is written to
benchmarks/results/making_longer.jsonl, which `python -m benchmarks.making_page` reads.
"""

import argparse
import json

from hemline import animators, bodies
from hemline.bench.machine import commit, machine
from hemline.datasets import open_dataset
from hemline.make.clips import CHECK_CLIP, clean_part
from hemline.make.trial import Trial, run_trial
from hemline.metrics import model_mb
from hemline.motions import open_motion

from .making import FOLDER, ROOT, WARDROBE, model_file

RESULTS = ROOT / "benchmarks" / "results" / "making_longer.jsonl"


def lengths(name: str) -> list[float]:
    """Returns the times in which models of a garment were made, in ascending order [min]."""
    found = [path.stem.removeprefix(f"{name}-") for path in FOLDER.glob(f"{name}-*.safetensors")]
    return sorted(float(text) for text in found if text.replace(".", "", 1).isdigit())


def compare(name: str) -> dict[float, Trial]:
    """Returns the figures of the models of a garment on the clip of the longest run, by the time they were made in."""
    minutes = lengths(name)
    check = open_dataset(model_file(name, minutes[-1]).with_suffix(".making") / "check")
    frames = sum(row.clip_frames for row in check.clips())
    clip = clean_part(open_motion(CHECK_CLIP))[:frames]
    found = {}
    for each in minutes:
        file = model_file(name, each)
        animator = animators.load(file)
        found[each] = run_trial(animator, bodies.load(animator.body_name).shaped(), clip, check, model_mb(file))
    return {each: played.trial for each, played in found.items()}


def main() -> None:
    """Compares the models and writes the lines."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="Names of the wardrobe. Defaults to all that were made twice.")
    options = parser.parse_args()
    lines = []
    for name in options.names or [name for name in WARDROBE if len(lengths(name)) > 1]:
        for minutes, trial in compare(name).items():
            row = {"name": name, "minutes": minutes, "machine": machine(), "commit": commit(), "trial": trial.entries()}
            lines.append(json.dumps(row) + "\n")
            print(lines[-1], end="", flush=True)
    RESULTS.write_text("".join(lines))


if __name__ == "__main__":
    main()
