"""`hemline fit DATASET --animator ropes -o MODEL`."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from hemline.animators.ropes.config import RopesConfig

from .progress import bars


@dataclass(frozen=True)
class Arguments:
    """Fit an animator to a dataset."""

    dataset: Annotated[Path, tyro.conf.Positional]
    """The folder that `hemline simulate` made."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The model file (.safetensors)."""
    animator: Literal["ropes"] = "ropes"
    """The animator."""
    seed: int = 0
    """Seed of the training; the same seed gives the same model on one machine."""
    config: tyro.conf.OmitArgPrefixes[RopesConfig] = field(default_factory=RopesConfig)
    """Options of the animator."""
    json: bool = False
    """Print the figures of the fit as one JSON object."""


def run(arguments: Arguments) -> int:
    """Fit and save."""
    from hemline.animators import animator_kind
    from hemline.datasets import open_dataset
    from hemline.files import check_writable

    check_writable(arguments.output)
    dataset = open_dataset(arguments.dataset)
    kind = animator_kind(arguments.animator)
    with bars() as display:
        tasks: dict[str, int] = {}

        def progress(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = display.add_task(stage, total=total)
            display.update(tasks[stage], completed=done, total=total)

        checkpoints = arguments.output.with_suffix(".fitting")
        animator = kind.fit(dataset, arguments.config, seed=arguments.seed, progress=progress, checkpoints=checkpoints)
    animator.save(arguments.output)
    if arguments.json:
        print(json.dumps({"model": str(arguments.output), "figures": animator.figures}))
    else:
        for name, value in animator.figures.items():
            print(f"{name:<28} {value:.4g}")
        print(arguments.output)
    return 0
