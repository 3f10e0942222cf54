"""Stores constants of spring bones in a model of rope chains: `python -m hemline.models.make.springs MODEL DATASET`.

They are tuned to the takes of the dataset, as `hemline character MODEL --takes DATASET` does. Nothing else changes.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from hemline.animators import load
from hemline.animators.ropes.springs.tuning import tune_springs
from hemline.datasets import open_dataset


def main(path: Path, folder: Path) -> None:
    """Tunes the springs of a model file, writes the file again, and prints the figures of the takes."""
    model = load(path)
    constants, figures = tune_springs(model, open_dataset(folder))
    replace(model, springs=constants).save(path)
    sys.stdout.write("".join(f"{name:<32} {value:.1f}\n" for name, value in figures.items()) + f"{constants}\n")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path)
    parser.add_argument("dataset", type=Path)
    options = parser.parse_args()
    main(options.model, options.dataset)
