"""Which reach of affinity tells kinds of garments apart: `python -m papers.swingar.descriptor TAKES...`.

TAKES are datasets of generated garments, whose names say their kinds. For each reach of the affinity and each transform
of the eigenvalues it counts how often the nearest other garment is of the same kind. Even seeds choose the reach, odd
seeds test it.
"""

import argparse
import re
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from hemline.animators.coarse.features.descriptor import sample_points
from hemline.animators.coarse.relatives import DESCRIPTOR_SIZE
from hemline.datasets import open_dataset

REACHES = (0.08, 0.15, 0.3, 0.4, 0.5, 0.6, 0.8, 1.2, 2.0)
TRANSFORMS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "as they are": lambda values: values,
    "asinh": np.arcsinh,
    "asinh of 10 times": lambda values: np.arcsinh(10 * values),
    "asinh of 100 times": lambda values: np.arcsinh(100 * values),
    "asinh of 1000 times": lambda values: np.arcsinh(1000 * values),
    "signed root": lambda values: np.sign(values) * np.sqrt(np.abs(values)),
}
NAME = re.compile(r"(?:close-)?([a-z]+)-(\d+)")


def main() -> None:
    """Prints the fractions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("takes", nargs="+", type=Path)
    kinds, seeds, distances = [], [], []
    for folder in parser.parse_args().takes:
        garment = open_dataset(folder).garment
        named = NAME.fullmatch(garment.name)
        if named is None:
            sys.exit(f"{folder} must hold a generated garment; got '{garment.name}'")
        kinds.append(named[1])
        seeds.append(int(named[2]))
        distances.append(sample_points(garment.vertices, garment.faces, DESCRIPTOR_SIZE)[1])
    kind, even = np.array(kinds), np.array(seeds) % 2 == 0
    print(f"{even.sum()} garments choose, {(~even).sum()} judge; by chance about {100 / len(set(kinds)):.0f} %")
    for reach in REACHES:
        values = np.zeros((len(distances), DESCRIPTOR_SIZE))
        for row, between in zip(values, distances, strict=True):
            found = np.linalg.eigvalsh(np.exp(-((between / reach) ** 2) / 2))[::-1]
            row[: len(found)] = found
        for name, transform in TRANSFORMS.items():
            shares = [alike(transform(values)[side], kind[side]) for side in (even, ~even)]
            print(
                f"reach {reach:4.2f} m, {name:19} chosen by {shares[0]:3.0f} %, judged {shares[1]:3.0f} %", flush=True
            )


def alike(values: np.ndarray, kind: np.ndarray) -> float:
    """Returns the fraction of garments whose nearest other one is of the same kind [%]."""
    apart = np.linalg.norm(values[:, None] - values[None], axis=2)
    np.fill_diagonal(apart, np.inf)
    return 100 * float((kind[apart.argmin(axis=1)] == kind).mean())


if __name__ == "__main__":
    main()
