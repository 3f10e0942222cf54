"""Options of the fit of `swingar`."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from hemline.animators.coarse.config import CoarseConfig
from hemline.options import not_negative, positive

Sizes = Literal["lean", "full"]


@dataclass(frozen=True)
class SwingarConfig(CoarseConfig):
    """Options.

    Raises:
        BadInput: A value that makes no sense, such as no groups.
    """

    SIZES: ClassVar[tuple[str, ...]] = (*CoarseConfig.SIZES, "sizes", "features", "alpha")

    sizes: Sizes = "lean"
    """Sizes of the network: those of the paper, or smaller ones."""
    features: bool = True
    """Whether the network is given how vertices trail and what is near them, and displaces them by that; off: as the
    paper describes it."""
    alpha: float = not_negative(2.0)
    """Scale of the attention scores."""
    groups: int = positive(100)
    """Groups of frames in an epoch."""
    term_epochs: int = not_negative(0)
    """Epochs that the coarse predictor goes on with all terms of the loss."""
    corrective_epochs: int = not_negative(0)
    """Epochs of the corrective predictor; 0: there is none."""
    device: str = "cpu"
    """Where it is trained: `cpu`, or `cuda` where torch finds a GPU."""
