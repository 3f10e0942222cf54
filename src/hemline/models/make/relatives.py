"""Describe the garments of a fit anew: `python -m hemline.models.make.relatives MODEL GARMENT...`.

MODEL is a model file of `lag` or `swingar`, whose spectral descriptors are those of an older hemline, say. Each garment
of its fit is named as `swingar_takes` was given it, or by the dataset that was made of it. MODEL is written anew, whole
or not at all; its weights stay as they are.
"""

import argparse
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

from hemline import bodies
from hemline.animators import load
from hemline.animators.coarse.relatives import Relatives
from hemline.animators.coarse.wearable import CoarseWearable
from hemline.datasets import open_dataset
from hemline.errors import HemlineError
from hemline.garments import Garment, open_garment
from hemline.garments.proxy.proxy import ProxySize, proxy_of


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("garments", nargs="+")
    given = parser.parse_args()
    try:
        model = load(given.model)
        if not isinstance(model, CoarseWearable):
            sys.exit(f"{given.model} must be a model of lag or swingar, without a garment; got {model.name}")
        weights = model.weights
        proxies = [proxy(name, weights.config.size) for name in given.garments]
        wanted, found = Counter(weights.relatives.names), Counter(each.name for each in proxies)
        if wanted != found:
            missing, more = sorted((wanted - found).elements()), sorted((found - wanted).elements())
            sys.exit(f"name the garments of the fit; missing: {' '.join(missing)}; not of it: {' '.join(more)}")
        described = Relatives.of_garments(sorted(proxies, key=lambda each: weights.relatives.names.index(each.name)))
        CoarseWearable(replace(weights, relatives=described)).save(given.model)
    except HemlineError as error:
        sys.exit(f"hemline: {error}")


def proxy(name: str, size: ProxySize) -> Garment:
    """The coarse copy of a garment by its name, its file or its dataset."""
    if Path(name).is_dir():
        return proxy_of(open_dataset(name).garment, size)[0]
    return proxy_of(open_garment(name, bodies.load("anny24").shaped(), dressed=False), size)[0]


if __name__ == "__main__":
    main()
