"""Options common to the networks that animate a coarse proxy mesh."""

from dataclasses import dataclass
from typing import ClassVar

from hemline.garments.proxy.proxy import ProxySize
from hemline.options import check_options, fraction, not_negative, positive


@dataclass(frozen=True)
class CoarseConfig:
    """Options common to the fits of `lag` and `swingar`.

    Raises:
        BadInput: An option is out of its range, such as no epochs.
    """

    SIZES: ClassVar[tuple[str, ...]] = ("edge", "fewest", "most")
    """Options stored with the weights: a fit that starts from other weights takes them over."""

    start: str = ""
    """Model file, or name of a shipped model, whose weights training starts from.
    Takes of a single garment then suffice, and the sizes of that model replace those given here.
    By default training starts from random weights."""
    edge: float = positive(ProxySize().edge)
    """Edge length of the proxy mesh [m]."""
    fewest: int = positive(ProxySize().fewest)
    """Minimum number of vertices of the proxy mesh."""
    most: int = positive(ProxySize().most)
    """Maximum number of vertices of the proxy mesh."""
    epochs: int = positive(30)
    """Number of passes over the training set."""
    rate: float = positive(1e-3)
    """Initial learning rate."""
    frames: int = positive(8)
    """Number of frames of one garment in a batch."""
    garments: int = positive(2)
    """Number of garments in a batch."""
    stride: int = positive(3)
    """Interval between the frames of a take that are learned [frames]."""
    evenness: float = not_negative(0.5)
    """Exponent that balances garments: a garment's loss is divided by its skinning error to this power.
    With 0, errors count in millimetres; with 1, they count relative to the skinning error."""
    unknown: float = fraction(0.2)
    """Fraction of frame groups, between 0 and 1, that are trained without knowing how the garment lay at the start."""
    beginning: float = not_negative(1.0)
    """Time for which a garment is simulated before the network moves it [s].
    With 0 it starts where skinning puts it."""
    mirrored: bool = True
    """Exchange left and right in half of the training frames."""
    held_out: float = positive(0.15)
    """Fraction of subjects and of garments that are kept out of training to choose the best epoch."""
    threads: int = positive(1)
    """Number of PyTorch threads."""
    jobs: int = positive(1)
    """Number of processes that read takes."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def recent(self) -> int:
        """Number of frames before each learned one that the training needs as well."""
        return 0

    @property
    def size(self) -> ProxySize:
        """Limits of the size of the proxy meshes."""
        return ProxySize(self.edge, self.fewest, self.most)
