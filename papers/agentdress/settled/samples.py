"""Settled garments for the tests: `python -m papers.agentdress.settled.samples GARMENT TEST`.

TEST is the folder of that name of `papers.agentdress.errors`; the garments of TEST-played are read, or made. Writes
tests/models/settled/GARMENT.safetensors with five garments on the mean body and five on random bodies, in poses as
played of people who appear in no fit. `tests/models/test_models_settled.py` judges the shipped model on them.
"""

from pathlib import Path

import numpy as np

from hemline import garments
from hemline.files import write_tensors
from papers.agentdress.settled.pairs import Worn, settle_as_played
from papers.report import ROOT, parse_options

FOLDER = ROOT / "tests" / "models" / "settled"
EACH, STEP = 5, 5e-5
"""Number of garments on the mean body and on random ones, and size of a step of their coordinates [m]."""


def choose(settled: list[Worn]) -> list[Worn]:
    """Returns garments that are spread evenly over the clips."""
    return [settled[int(index)] for index in np.linspace(0, len(settled) - 1, EACH).round()]


def main() -> None:
    """Reads or makes the garments and writes the file."""
    options = parse_options(__doc__, "model", "test", played=(24, "number of poses of each clip"), seed=0, jobs=1)
    garment, folder = garments.load(options.model), Path(f"{options.test}-played")
    how = {"count": options.played, "seed": options.seed, "jobs": options.jobs}
    chosen = [
        each
        for random in (False, True)
        for each in choose(list(settle_as_played(folder, garment, random=random, **how)))
    ]
    betas = np.zeros((len(chosen), 16), np.float32)
    for row, each in zip(betas, chosen, strict=True):
        row[: len(each.betas)] = each.betas
    arrays = {
        "rotations": np.array([each.pose.rotations for each in chosen], np.float32),
        "translations": np.array([each.pose.translation for each in chosen], np.float32),
        "betas": betas,
        "vertices": np.array([np.round(each.vertices / STEP) for each in chosen]).astype(np.int16),
    }
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{garment.name}.safetensors"
    metadata = {"kind": "settled", "garment": garment.hash, "step": STEP, "clips": [each.clip for each in chosen]}
    write_tensors(path, arrays, metadata)
    print(f"{path}: {len(chosen)} garments")


if __name__ == "__main__":
    main()
