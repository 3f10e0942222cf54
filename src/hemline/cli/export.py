"""`hemline export DATASET --take N -o FILE`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.errors import BadInput


@dataclass(frozen=True)
class Arguments:
    """Write one simulated take, without its lead-in."""

    dataset: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="DATASET")]
    """The folder that `hemline simulate` made."""
    take: int
    """Which of its takes, counted from 0: clips in the order of their names, long ones in parts of ten seconds."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The file; its ending chooses the format: .glb .usdc .obj .npz .pc2 .mdd, or a picture: .png .webp."""
    lead_in: bool = False
    """Also the frames before the clip, in which the cloth is led into its first pose."""


def run(arguments: Arguments) -> int:
    """Read the take, skin the body it was simulated against, write."""
    from hemline import bodies, export
    from hemline.datasets import open_dataset
    from hemline.playback.record import recorded_take

    export.check_format(arguments.output)
    dataset = open_dataset(arguments.dataset)
    rows = [row for row in dataset.rows() if row.kind == "clip"]
    if not 0 <= arguments.take < len(rows):
        there = f"the takes 0 to {len(rows) - 1}" if rows else "no takes of clips"
        raise BadInput(f"{arguments.dataset} has {there}", f"--take {arguments.take}", "name one of them")
    take = dataset.take(rows[arguments.take])
    body = bodies.load(dataset.garment.body_name).shaped(take.betas)
    for path in export.write(arguments.output, recorded_take(take, dataset.garment, body, lead_in=arguments.lead_in)):
        print(path)
    return 0
