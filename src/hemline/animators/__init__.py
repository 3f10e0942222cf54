"""Animators: fitted parameters that turn a moving body into a moving garment. Their interface is in `base`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from .base import Animator as Animator
from .base import AnimatorKind as AnimatorKind
from .base import Bounded as Bounded
from .base import CloseFitting as CloseFitting
from .base import Driven as Driven
from .base import MaterialAware as MaterialAware
from .base import Movable as Movable
from .base import Progress as Progress
from .base import Redressing as Redressing
from .base import Related as Related
from .base import Settled as Settled
from .base import Wearable as Wearable
from .base import Windy as Windy
from .lazy_kind import LazyKind as LazyKind
from .model_file import load as load
from .model_file import model_path as model_path
from .model_file import shipped_models as shipped_models
from .registry import animator_kind as animator_kind
from .registry import animator_names as animator_names
from .together import AnimatorTogether as AnimatorTogether
from .together import together as together

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset


def fit(
    data: "Dataset | Collection",
    animator: str = "ropes",
    config: Any = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> Animator | Wearable:
    """Fits an animator to simulated takes, without those in which a limb is through the cloth or the cloth is torn.

    Warns if takes are left out, and if they are of several versions of the simulator.

    Args:
        data: Simulated takes of a garment, or of several if the animator learns from many.
        animator: Name of the animator.
        config: Options of the fit, a `Config` of its kind; None uses the defaults.
        seed: Seed of everything random.
        progress: Called with the stage, the steps done and the number of steps.
        checkpoints: Folder for the state of the training, from which a killed fit continues.

    Returns:
        The animator, ready to play or to save, or a `Wearable` if it was fitted on many garments.

    Raises:
        BadInput: There is no such animator.
        BadDataset: The dataset holds too little, or several were given to an animator of one garment.
        MissingExtra: The animator learns with a library that is not installed.
    """
    from hemline.datasets import Collection, Dataset, leave_out_faulty, warn_of_several

    kind = animator_kind(animator)
    if isinstance(data, Dataset | Collection):  # an animator of another package may learn from something else
        warn_of_several(data.datasets if isinstance(data, Collection) else (data,))
        data = leave_out_faulty(data)
    return kind.fit(data, config, seed=seed, progress=progress, checkpoints=checkpoints)


__all__ = [
    "Animator",
    "AnimatorKind",
    "AnimatorTogether",
    "Bounded",
    "CloseFitting",
    "Driven",
    "LazyKind",
    "MaterialAware",
    "Movable",
    "Progress",
    "Redressing",
    "Related",
    "Settled",
    "Wearable",
    "Windy",
    "animator_kind",
    "animator_names",
    "fit",
    "load",
    "model_path",
    "shipped_models",
    "together",
]
