"""Options that are common to the networks that move a coarse garment."""

from dataclasses import dataclass
from typing import ClassVar

from hemline.garments.proxy.proxy import ProxySize
from hemline.options import check_options, not_negative, positive, share


@dataclass(frozen=True)
class CoarseConfig:
    """Options.

    Raises:
        BadInput: A value that makes no sense, such as no epochs.
    """

    SIZES: ClassVar[tuple[str, ...]] = ("edge", "fewest", "most")
    """Options that belong to the weights: where they are gone on from, theirs count."""

    start: str = ""
    """A model file, or the name of a shipped model, whose weights are gone on from: with it takes of a single garment
    are enough. Its sizes count, not those given here."""
    edge: float = positive(ProxySize().edge)
    """Length of the edges of the proxy [m]."""
    fewest: int = positive(ProxySize().fewest)
    """Vertices that it has at least."""
    most: int = positive(ProxySize().most)
    """Vertices that it has at most."""
    epochs: int = positive(30)
    """Passes over the training set."""
    rate: float = positive(1e-3)
    """First learning rate."""
    frames: int = positive(8)
    """Frames of a garment that are shown together."""
    garments: int = positive(2)
    """Garments in a batch."""
    stride: int = positive(8)
    """Every so many frames of a take are learned from, and the two before each of them."""
    evenness: float = not_negative(0.5)
    """Garments count by what skinning misses of them to minus this power: 0: millimetres of all are alike; 1: shares
    of it are."""
    unknown: float = share(0.2)
    """Share of the groups of frames that are shown without how the garment lay at the beginning."""
    beginning: float = not_negative(1.0)
    """A garment is simulated for so long before the network moves it; 0: it begins where skinning puts it [s]."""
    mirrored: bool = True
    """Whether half of the frames are shown with left and right exchanged."""
    held_out: float = positive(0.15)
    """Share of subjects and of garments that epochs are chosen by."""
    threads: int = positive(1)
    """Threads of torch."""
    jobs: int = positive(1)
    """Processes that read takes."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def size(self) -> ProxySize:
        """Size of the proxies that the network moves."""
        return ProxySize(self.edge, self.fewest, self.most)
