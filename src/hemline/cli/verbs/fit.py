"""`hemline fit DATASET... --animator NAME -o MODEL`."""

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field, make_dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from hemline.cli.progress import stages


@dataclass(frozen=True)
class FitOptions:
    """Options of `hemline fit` that all animators share."""

    dataset: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Dataset folders to learn from, made by simulate or drape."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Model file to write (.safetensors)."""
    animator: str | None = None
    """Animator to fit: agentdress, lag, ropes, swingar, or one of another package.
    Defaults to agentdress for drapes, ropes for takes, and lag for takes of several garments.
    Its options are listed by --animator NAME --help."""
    seed: int = 0
    """Seed of the training. The same seed gives the same model on one machine."""
    json: bool = False
    """Print the model file and the figures of the fit as one JSON object."""


def schema(words: Sequence[str]) -> type:
    """Returns the options of a fit: the common ones, and those of the animator that the words name.

    Raises:
        BadInput: No such animator is installed.
    """
    from hemline.animators import animator_kind

    config: Any = animator_kind(_animator_in(words)).Config
    config_field = ("config", tyro.conf.OmitArgPrefixes[config], field(default_factory=config))
    return make_dataclass("FitOptions", [config_field], bases=(FitOptions,), frozen=True)


def _animator_in(words: Sequence[str]) -> str:
    for index, word in enumerate(words):
        if word == "--animator":
            return words[index + 1] if index + 1 < len(words) else _suited([])
        if word.startswith("--animator="):
            return word.partition("=")[2]
    first_option = next((index for index, word in enumerate(words) if word.startswith("-")), len(words))
    return _suited([Path(word) for word in words[:first_option]])


def _suited(folders: Sequence[Path]) -> str:
    """Returns the animator that learns from these folders; folders without a dataset count for nothing."""
    from hemline.animators.suited import suited_animator
    from hemline.datasets import open_dataset

    return suited_animator([open_dataset(each) for each in folders if (each / "garment.safetensors").is_file()])


def run(options: Any) -> int:
    """Fits the animator and saves the model."""
    from hemline.errors import BadInput
    from hemline.files import check_folder, check_writable

    if not options.dataset:
        raise BadInput("no dataset", "hemline fit without a folder", "name what 'hemline simulate' made")
    with _process_group() as first:
        if first:
            check_writable(options.output)
            check_folder(_checkpoints(options))
        model = _fit(options, first)
        if not first:
            return 0
        model.save(options.output)
    if options.json:
        print(json.dumps({"model": str(options.output), "figures": model.figures}))
    else:
        for name, value in model.figures.items():
            print(f"{name:<28} {value:.4g}")
        print(options.output)
    return 0


def _checkpoints(options: Any) -> Path:
    """Returns the folder of training checkpoints beside the model."""
    return options.output.with_suffix(".fitting")


def _fit(options: Any, first: bool) -> Any:
    from hemline import animators
    from hemline.datasets import open_collection, open_dataset

    several = len(options.dataset) > 1
    data = open_collection(options.dataset) if several else open_dataset(options.dataset[0])
    with stages() if first else nullcontext() as progress:
        return animators.fit(
            data,
            options.animator or _suited(options.dataset),
            options.config,
            seed=options.seed,
            progress=progress,
            checkpoints=_checkpoints(options) if first else None,
        )


@contextmanager
def _process_group() -> Iterator[bool]:
    """Yields whether this process writes and prints; of several processes started by torchrun, the first one does."""
    if os.environ.get("WORLD_SIZE", "1") == "1":
        yield True
        return
    from hemline.learning.fit.group import join_group

    with join_group() as group:
        yield group.first
