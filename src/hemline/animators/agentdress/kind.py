"""The registry entry of `agentdress`."""

from pathlib import Path
from typing import TYPE_CHECKING

from hemline.animators.base import Progress
from hemline.animators.lazy_kind import LazyKind

from .config import AgentDressConfig

if TYPE_CHECKING:
    from hemline.datasets import Collection, Dataset

    from .model import AnimatorAgentDress


def fit_datasets(
    data: "Dataset | Collection",
    config: AgentDressConfig | None = None,
    *,
    seed: int = 0,
    progress: Progress | None = None,
    checkpoints: Path | None = None,
) -> "AnimatorAgentDress":
    """Fits AgentDress to anchors in about a minute; see `fit.fit`. Neither a seed nor checkpoints are needed.

    The first of several datasets holds the anchors. The others hold the same garment in other materials.

    Raises:
        BadDataset: `fit.fit` refuses a dataset.
        BadInput: `fit.fit` refuses an option.
    """
    from hemline.animators.agentdress.fit.fit import fit
    from hemline.datasets import Collection

    first, *others = data.datasets if isinstance(data, Collection) else (data,)
    return fit(first, config, materials=others, progress=progress)


KIND = LazyKind(
    "agentdress",
    AgentDressConfig,
    fit=fit_datasets,
    of="hemline.animators.agentdress.model:AnimatorAgentDress.of",
)
