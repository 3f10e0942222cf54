"""`hemline drape GARMENT -o DATASET --spread 4`."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from hemline.errors import BadInput

from .garment import open_garment
from .progress import bars


@dataclass(frozen=True)
class Arguments:
    """Settle a garment on bodies of many shapes, at rest."""

    garment: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="GARMENT")]
    """A garment by name (cape, skirt, tshirt, longsleeve, trousers, dress; light ones: cape-light ...), or a file."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The dataset, a folder; made when missing, continued when there."""
    tryon: bool = True
    """Try a mesh on first that does not sit on the body; otherwise it is taken as it lies, or refused."""
    spread: int = 0
    """Besides the mean body, bodies where one of the first so many betas is -2, -1, 1 or 2: four for each."""
    random: int = 0
    """Besides these, so many random bodies."""
    seed: int = 0
    """Another number gives other random bodies."""
    body: str = "anny24"
    """The body: anny24, or a file (.safetensors, SMPL .npz or .pkl)."""
    json: bool = False
    """Print the drapes as a JSON list instead of a table."""


def run(arguments: Arguments) -> int:
    """Drape; status 1 when there is a shape on which the garment could not be settled."""
    from hemline import bodies
    from hemline.sim import produce_rests, random_shapes, spread_shapes

    body = bodies.load(arguments.body)
    for name in ("spread", "random", "seed"):
        if getattr(arguments, name) < 0:
            raise BadInput(f"--{name} must not be negative", getattr(arguments, name), "give 0 or more")
    if arguments.spread > len(body.shapedirs):
        raise BadInput(f"--spread: {body.name} has {len(body.shapedirs)} betas", arguments.spread, "give fewer")
    shapes = [*spread_shapes(arguments.spread), *random_shapes(body, arguments.random, arguments.seed)]
    garment = open_garment(arguments.garment, body.shaped(), arguments.output, tryon=arguments.tryon)
    with bars() as display:
        task = display.add_task(garment.name, total=len(shapes))
        found = produce_rests(
            arguments.output,
            garment,
            shapes,
            report=lambda done, total: display.update(task, completed=done, total=total),
        )
    rows = [
        {"betas": list(betas), "reason": rest, "figures": {}}
        if isinstance(rest, str)
        else {"betas": list(betas), "reason": None, "figures": {key: float(v) for key, v in rest.figures.items()}}
        for betas, rest in zip(shapes, found, strict=True)
    ]
    if arguments.json:
        print(json.dumps(rows))
    else:
        for row in rows:
            shape = " ".join(f"{beta:.3g}" for beta in row["betas"]) or "0"
            figures = "  ".join(f"{key} {value:.3g}" for key, value in row["figures"].items())
            print(f"betas {shape}:  {row['reason'] or figures}")
    return 1 if any(row["reason"] for row in rows) else 0
