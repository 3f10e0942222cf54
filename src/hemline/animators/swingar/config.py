"""Options of the fit of `swingar`."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from hemline.animators.coarse.config import CoarseConfig
from hemline.options import not_negative, positive

from .estimator_config import MESHES

Sizes = Literal["lean", "full"]


@dataclass(frozen=True)
class SwingarConfig(CoarseConfig):
    """Options of the fit of `swingar`.

    Raises:
        BadInput: An option is out of its range, such as no groups.
    """

    SIZES: ClassVar[tuple[str, ...]] = (*CoarseConfig.SIZES, "sizes", "features", "alpha")

    sizes: Sizes = "lean"
    """Layer sizes of the network: those of the paper (full), or smaller ones (lean)."""
    features: bool = True
    """Give the network features of lagging vertices and their surroundings, and displace vertices by them.
    With --no-features it is the network of the paper."""
    alpha: float = not_negative(2.0)
    """Scale factor of the attention scores."""
    groups: int = positive(100)
    """Number of frame groups in an epoch."""
    term_epochs: int = not_negative(0)
    """Number of further epochs in which the coarse predictor is trained with all loss terms."""
    corrective_epochs: int = not_negative(0)
    """Number of epochs of the corrective predictor. With 0 there is no corrective predictor."""
    device: str = "cpu"
    """Device to train on: cpu, or cuda if PyTorch finds a GPU."""

    @property
    def recent(self) -> int:
        """Number of frames before each learned one that the training needs, for the corrective predictor."""
        return MESHES - 1 if self.corrective_epochs else 0
