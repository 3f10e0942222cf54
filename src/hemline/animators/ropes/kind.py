"""The registry entry of `ropes`."""

from pathlib import Path
from typing import TYPE_CHECKING

from hemline.animators.base import Progress
from hemline.animators.lazy_kind import LazyKind
from hemline.errors import BadDataset

from .config import RopesConfig

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset

    from .model import AnimatorRopes


def fit_dataset(
    data: "Dataset | Collection",
    config: RopesConfig | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> "AnimatorRopes":
    """Fits rope chains to simulated takes of one garment; see `fit.fit`.

    Raises:
        BadDataset: The takes are of several garments, or `fit.fit` refuses them.

    Warns:
        HemlineWarning: See `motion_range.warn_of_missing_motion` and `fit.fit`.
    """
    from hemline.animators.ropes.fit.fit import fit
    from hemline.animators.ropes.fit.gather import TakeFrames
    from hemline.animators.ropes.fit.motion_range import warn_of_missing_motion
    from hemline.datasets import Collection

    if isinstance(data, Collection):
        names = ", ".join(garment.name for garment in data.garments)
        raise BadDataset("rope chains are fitted to one garment", names, "name one dataset")
    warn_of_missing_motion(TakeFrames.of(data))
    return fit(data, config, seed=seed, progress=progress, checkpoints=checkpoints)


KIND = LazyKind("ropes", RopesConfig, fit=fit_dataset, of="hemline.animators.ropes.model:AnimatorRopes.of")
