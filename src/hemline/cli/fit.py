"""`hemline fit DATASET... --animator NAME -o MODEL`."""

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from .progress import stages

DEFAULT = "ropes"


@dataclass(frozen=True)
class Fit:
    """Fit an animator to one dataset, or to several that it learns from together."""

    dataset: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Folders that `hemline simulate` or `hemline drape` made."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """The model file (.safetensors)."""
    animator: str = DEFAULT
    """The animator: ropes, or one that another package brings; `--animator NAME --help` tells its options."""
    seed: int = 0
    """Seed of the training; the same seed gives the same model on one machine."""
    json: bool = False
    """Print the figures of the fit as one JSON object."""


def schema(words: Sequence[str]) -> type:
    """The flags of the animator that the words name: those of every fit, and the options of its own.

    Raises:
        BadInput: No such animator is installed.
    """
    from hemline.animators import animator_kind

    config: Any = animator_kind(_animator_in(words)).Config
    options = ("config", tyro.conf.OmitArgPrefixes[config], field(default_factory=config))
    return make_dataclass("Arguments", [options], bases=(Fit,), frozen=True)


def _animator_in(words: Sequence[str]) -> str:
    for index, word in enumerate(words):
        if word == "--animator":
            return words[index + 1] if index + 1 < len(words) else DEFAULT
        if word.startswith("--animator="):
            return word.partition("=")[2]
    return DEFAULT


def run(arguments: Any) -> int:
    """Fit and save."""
    from hemline.errors import BadInput
    from hemline.files import check_folder, check_writable

    if not arguments.dataset:
        raise BadInput("no dataset", "hemline fit without a folder", "name what 'hemline simulate' made")
    with _together() as first:
        if first:
            check_writable(arguments.output)
            check_folder(_checkpoints(arguments))
        model = _fitted(arguments, first)
        if not first:
            return 0
        model.save(arguments.output)
    if arguments.json:
        print(json.dumps({"model": str(arguments.output), "figures": model.figures}))
    else:
        for name, value in model.figures.items():
            print(f"{name:<28} {value:.4g}")
        print(arguments.output)
    return 0


def _checkpoints(arguments: Any) -> Path:
    """The folder beside the model where the state of the training is kept."""
    return arguments.output.with_suffix(".fitting")


def _fitted(arguments: Any, first: bool) -> Any:
    from hemline import animators
    from hemline.datasets import open_collection, open_dataset

    several = len(arguments.dataset) > 1
    data = open_collection(arguments.dataset) if several else open_dataset(arguments.dataset[0])
    with stages() if first else nullcontext() as progress:
        return animators.fit(
            data,
            arguments.animator,
            arguments.config,
            seed=arguments.seed,
            progress=progress,
            checkpoints=_checkpoints(arguments) if first else None,
        )


@contextmanager
def _together() -> Iterator[bool]:
    """Whether this process writes and prints: of those that torchrun has started, the first one."""
    if os.environ.get("WORLD_SIZE", "1") == "1":
        yield True
        return
    from hemline.learning.fit.group import joined

    with joined() as group:
        yield group.first
