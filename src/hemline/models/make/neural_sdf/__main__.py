"""Train the neural signed distance of a body: `python -m hemline.models.make.neural_sdf CLIPS DATA -o FILE`.

CLIPS is a folder of BVH clips, split by subject; DATA is where samples and the training are kept: a killed command
goes on from there. `--inputs point --width 512` is the network of the paper.
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

from .samples import clips_by_side, produce
from .training import SdfConfig, trained

HELD_OUT = 100
"""Posed bodies of validation subjects."""
USUAL = SdfConfig()


def make(asked: argparse.Namespace) -> None:
    """Make what is missing of the samples, train, write."""
    named = {name: getattr(asked, name) for name in ("inputs", "width", "updates", "seed")}
    config = replace(USUAL, **named)
    body, sides = bodies.load(asked.body), functools.cache(lambda: clips_by_side(asked.clips))
    train = produce(asked.data / "train", body, lambda: sides()["train"], asked.bodies, 0)
    held_out = produce(asked.data / "val", body, lambda: sides()["val"], HELD_OUT, 1)
    name = f"training-{content_hash(asdict(config))}.safetensors"
    trained(
        body,
        train,
        held_out,
        config,
        checkpoint=asked.data / name,
        progress=_say,
    ).save(asked.out)


def _say(done: int, total: int) -> None:
    sys.stderr.write(f"\repoch {done} of {total}")


def main() -> None:
    """Read the arguments."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clips", type=Path, help="folder of BVH clips")
    parser.add_argument("data", type=Path, help="folder for samples and checkpoints")
    parser.add_argument("-o", "--out", type=Path, required=True, help="the file to write, .safetensors")
    parser.add_argument("--body", default="anny24", help="the body")
    parser.add_argument("--bodies", type=int, default=1000, help="posed bodies to learn from, in hundreds")
    parser.add_argument("--inputs", choices=get_args(Inputs), default=USUAL.inputs, help="what is read of a point")
    parser.add_argument("--width", type=int, default=USUAL.width, help="neurons in a hidden layer; 512 in the paper")
    parser.add_argument("--updates", type=int, default=USUAL.updates, help="steps of the optimiser")
    parser.add_argument("--seed", type=int, default=USUAL.seed, help="of all that is drawn")
    make(parser.parse_args())


if __name__ == "__main__":
    try:
        main()
    except HemlineError as error:
        sys.exit(str(error))
