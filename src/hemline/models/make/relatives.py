"""Recomputes the garment descriptors of a fit: `python -m hemline.models.make.relatives MODEL GARMENT...`.

MODEL is a model file of `lag` or `swingar`, for example one whose descriptors were made by an older hemline. Each
garment of its fit is named as for `swingar_takes`, or by its dataset folder. MODEL is overwritten; its weights do not
change.
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
from hemline.garments import Garment
from hemline.garments.proxy.proxy import ProxySize, proxy_of
from hemline.tryon import open_garment


def main() -> None:
    """Writes the model file with new descriptors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path, help="Model file, which is overwritten.")
    parser.add_argument("garments", nargs="+", help="All garments of the fit: names, files or dataset folders.")
    options = parser.parse_args()
    try:
        model = load(options.model)
        if not isinstance(model, CoarseWearable):
            sys.exit(f"{options.model} must be a model of lag or swingar, without a garment; got {model.name}")
        weights = model.weights
        proxies = [open_proxy(name, weights.config.size) for name in options.garments]
        expected, named = Counter(weights.relatives.names), Counter(garment.name for garment in proxies)
        if expected != named:
            missing, more = sorted((expected - named).elements()), sorted((named - expected).elements())
            sys.exit(f"name the garments of the fit; missing: {' '.join(missing)}; not of it: {' '.join(more)}")
        order = weights.relatives.names.index
        relatives = Relatives.of_garments(sorted(proxies, key=lambda garment: order(garment.name)))
        CoarseWearable(replace(weights, relatives=relatives)).save(options.model)
    except HemlineError as error:
        sys.exit(f"hemline: {error}")


def open_proxy(name: str, size: ProxySize) -> Garment:
    """Opens the proxy mesh of a garment by name, file or dataset folder."""
    if Path(name).is_dir():
        return proxy_of(open_dataset(name).garment, size)[0]
    return proxy_of(open_garment(name, bodies.load("anny24").shaped(), tryon="never", dressed=False), size)[0]


if __name__ == "__main__":
    main()
