"""Trains the neural signed distance of a body: `python -m hemline.models.make.neural_sdf CLIPS DATA -o FILE`.

CLIPS is a folder of BVH clips, which are split by subject. DATA is a folder for samples and checkpoints, from which a
killed command continues. `--inputs point --width 512` is the network of the paper.
"""

import argparse
import functools
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import get_args

from hemline import bodies
from hemline.collide.neural_sdf.inputs import Inputs
from hemline.errors import HemlineError
from hemline.files import content_hash

from .samples import clips_by_side, produce_samples
from .training import SdfConfig, train_sdf

HELD_OUT = 100
"""Number of posed bodies of validation subjects."""
DEFAULTS = SdfConfig()


def make(options: argparse.Namespace) -> None:
    """Makes missing samples, trains the network and writes it."""
    values = {name: getattr(options, name) for name in ("inputs", "width", "updates", "seed")}
    config = replace(DEFAULTS, **values)
    body, sides = bodies.load(options.body), functools.cache(lambda: clips_by_side(options.clips))
    train = produce_samples(options.data / "train", body, lambda: sides()["train"], options.bodies, 0)
    held_out = produce_samples(options.data / "val", body, lambda: sides()["val"], HELD_OUT, 1)
    name = f"training-{content_hash(asdict(config))}.safetensors"
    train_sdf(
        body,
        train,
        held_out,
        config,
        checkpoint=options.data / name,
        progress=_show,
    ).save(options.out)


def _show(done: int, total: int) -> None:
    sys.stderr.write(f"\repoch {done} of {total}")


def main() -> None:
    """Parses the options and trains."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, help="Folder of BVH clips.")
    parser.add_argument("data", type=Path, help="Folder for samples and checkpoints.")
    parser.add_argument("-o", "--out", type=Path, required=True, help="File to write (.safetensors).")
    parser.add_argument("--body", default="anny24", help="Body to train on.")
    parser.add_argument("--bodies", type=int, default=1000, help="Number of posed bodies, in hundreds.")
    parser.add_argument("--inputs", choices=get_args(Inputs), default=DEFAULTS.inputs, help="Inputs of a point.")
    parser.add_argument("--width", type=int, default=DEFAULTS.width, help="Neurons of a hidden layer (paper: 512).")
    parser.add_argument("--updates", type=int, default=DEFAULTS.updates, help="Number of optimiser steps.")
    parser.add_argument("--seed", type=int, default=DEFAULTS.seed, help="Seed of bodies, points and weights.")
    make(parser.parse_args())


if __name__ == "__main__":
    try:
        main()
    except HemlineError as error:
        sys.exit(str(error))
