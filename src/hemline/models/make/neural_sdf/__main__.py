"""Train the neural signed distance of a body: `python -m hemline.models.make.neural_sdf CLIPS DATA -o FILE`.

CLIPS is a folder of BVH clips, split by subject; DATA is where samples and the training are kept: a killed command
goes on from there. `--inputs point --width 512` is the network of the paper.
"""

import functools
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from hemline import bodies
from hemline.errors import HemlineError
from hemline.files import content_hash

from .samples import clips_by_side, produce
from .training import SdfConfig, trained

HELD_OUT = 100
"""Posed bodies of validation subjects."""


@dataclass(frozen=True)
class Arguments:
    """Options of the command."""

    clips: Annotated[Path, tyro.conf.Positional]
    """Folder of BVH clips."""
    data: Annotated[Path, tyro.conf.Positional]
    """Folder for samples and checkpoints."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The file to write, .safetensors."""
    body: str = "anny24"
    """The body."""
    train_bodies: int = 1000
    """Posed bodies to learn from."""
    options: Annotated[SdfConfig, tyro.conf.arg(name="")] = field(default_factory=SdfConfig)


def make(asked: Arguments) -> None:
    """Make what is missing of the samples, train, write."""
    body, sides = bodies.load(asked.body), functools.cache(lambda: clips_by_side(asked.clips))
    train = produce(asked.data / "train", body, lambda: sides()["train"], asked.train_bodies, 0)
    held_out = produce(asked.data / "val", body, lambda: sides()["val"], HELD_OUT, 1)
    name = f"training-{content_hash(asdict(asked.options))}.safetensors"
    model = trained(
        body,
        train,
        held_out,
        asked.options,
        checkpoint=asked.data / name,
        progress=lambda done, total: print(f"\repoch {done} of {total}", end="", file=sys.stderr),
    )
    model.save(asked.out)
    print(f"\n{asked.out}: {dict(model.figures)}")


if __name__ == "__main__":
    try:
        make(tyro.cli(Arguments))
    except HemlineError as error:
        sys.exit(str(error))
