"""Makes the model of each method: fits those that are fitted, and dresses the others in the garment."""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hemline import animators
from hemline.animators import Animator, Progress, Wearable
from hemline.bodies import Body, ShapedBody
from hemline.datasets import open_dataset
from hemline.errors import HemlineError
from hemline.garments import Garment

from .settings import FITTED, METHODS
from .work_folder import WorkFolder


def suitable_methods(animator: str, body: Body) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Returns the methods that may be compared on this machine and body, and why others are left out.

    Args:
        animator: Name of the only method to use; empty for all.
        body: The body.
    """
    methods, left_out = list(METHODS), []
    if not len(body.shapedirs):
        methods.remove("agentdress")
        left_out.append(f"agentdress needs a body of many shapes, and '{body.name}' has one.")
    if animator:
        left_out = [reason for reason in left_out if reason.startswith(animator)]
        methods = [method for method in methods if method == animator]
    return tuple(methods), tuple(left_out)


def make_candidate(
    method: str,
    work: WorkFolder,
    garment: Garment,
    body: ShapedBody,
    seed: int,
    progress: Progress,
) -> tuple[Animator, Path]:
    """Returns the animator of a method, and its model file, which is made if it does not exist.

    Args:
        method: Name of the animator.
        work: Folder with the datasets of the fits.
        garment: The garment.
        body: The body of the garment in its mean shape.
        seed: Seed of the fit.
        progress: Called with the stage, the steps done and the total number of steps.

    Raises:
        HemlineError: The method cannot be fitted to this garment; the message says why.
    """
    path = candidate_path(work, method)
    if not path.exists():
        path.parent.mkdir(exist_ok=True)
        if method in FITTED:
            data = open_dataset(work.folder / ("takes" if method == "ropes" else "drapes"))
            checkpoints = path.with_suffix(".fitting")
            made: Any = animators.fit(data, method, None, seed=seed, progress=progress, checkpoints=checkpoints)
        else:
            made = animators.load(method)
        if isinstance(made, Wearable):
            made = made.animator_for(garment, body)
        made.save(path)
    return animators.load(path), path


def candidate_path(work: WorkFolder, method: str) -> Path:
    """Returns the model file of a method."""
    return work.folder / "candidates" / f"{method}.safetensors"


def remove_candidates(work: WorkFolder) -> None:
    """Deletes the models of all methods, which were made for another plan."""
    shutil.rmtree(work.folder / "candidates", ignore_errors=True)


def remove_unfinished(work: WorkFolder, method: str) -> None:
    """Deletes the state of a fit that was not finished."""
    shutil.rmtree(candidate_path(work, method).with_suffix(".fitting"), ignore_errors=True)


def try_candidate(make: Callable[[], tuple[Animator, Path]]) -> tuple[Animator, Path] | str:
    """Returns what a call of `make_candidate` returns, or the reason why it failed."""
    try:
        return make()
    except HemlineError as reason:
        return str(reason)
