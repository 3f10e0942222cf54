"""Animators: fitted parameters that turn a moving body into a moving garment. The contract is in `base`."""

from pathlib import Path
from typing import Any

from .base import Animator as Animator
from .base import Progress as Progress
from .model_file import load as load
from .model_file import shipped_models as shipped_models
from .registry import animator_class as animator_class
from .registry import animator_names as animator_names
from .registry import name_of as name_of


def fit(
    dataset: Any,
    animator: str = "ropes",
    config: Any = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> Animator:
    """Fit an animator to simulated takes.

    Args:
        dataset: A `hemline.datasets.Dataset`.
        animator: Name of the animator.
        config: Its options; None: the defaults.
        seed: Seed of all that is random.
        progress: Called with stage, steps done and steps in all.
        checkpoints: A folder where the state of the training is kept, so that a killed fit goes on.

    Returns:
        The animator, ready to play or to save.

    Raises:
        BadInput: No such animator.
        BadDataset: The dataset holds too little.
        MissingExtra: The animator learns with a library that is not installed.
    """
    return animator_class(animator).fit(dataset, config, seed=seed, progress=progress, checkpoints=checkpoints)


__all__ = ["Animator", "Progress", "animator_class", "animator_names", "fit", "load", "name_of", "shipped_models"]
