"""Options of the fit of `swingar`."""

from dataclasses import dataclass
from typing import Literal

from hemline.garments.proxy import ProxySize
from hemline.options import check_options, not_negative, positive, share

Learner = Literal["lag", "graph"]
Sizes = Literal["lean", "full"]
Precision = Literal["float32", "bfloat16"]


@dataclass(frozen=True)
class SwingarConfig:
    """Options.

    Raises:
        BadInput: A value that makes no sense, such as a width of 0.
    """

    learner: Learner = "lag"
    """What is learned: the lag network, or the paper's graph network."""
    start: str = ""
    """A model file, or the name of a shipped model, whose weights are gone on from: with it takes of a single garment
    are enough. Its sizes count, not those given here."""
    edge: float = positive(ProxySize().edge)
    """Length of the edges of the proxy [m]."""
    fewest: int = positive(ProxySize().fewest)
    """Vertices that it has at least."""
    most: int = positive(ProxySize().most)
    """Vertices that it has at most."""
    width: int = positive(128)
    """Units of the lag network's hidden layers."""
    sizes: Sizes = "lean"
    """Sizes of the graph network: those of the paper, or smaller ones."""
    features: bool = True
    """Whether the graph network is given how vertices trail and what is near them, and displaces them by that; off: as
    the paper describes it."""
    alpha: float = not_negative(2.0)
    """Scale of the graph network's attention scores."""
    epochs: int = positive(30)
    """Passes of the lag network over the training set; epochs of the graph network's coarse predictor."""
    term_epochs: int = not_negative(0)
    """Epochs that it goes on with all terms of the paper's loss."""
    corrective_epochs: int = not_negative(0)
    """Epochs of the graph network's corrective predictor; 0: it has none."""
    groups: int = positive(100)
    """Groups of frames in an epoch of the graph network."""
    rate: float = positive(1e-3)
    """First learning rate."""
    frames: int = positive(8)
    """Frames of a garment that are shown together."""
    vertices: int = positive(384)
    """Vertices of each that are learned from at a time: the ends of half as many edges."""
    garments: int = positive(2)
    """Garments in a batch."""
    stride: int = positive(8)
    """Every so many frames of a take are learned from, and the two before each of them."""
    edge_weight: float = not_negative(0.3)
    """Weight of the error of edge vectors, in edges, beside that of vertices."""
    evenness: float = not_negative(0.5)
    """Garments count by what skinning misses of them to minus this power: 0: millimetres of all are alike; 1: shares
    of it are."""
    unknown: float = share(0.2)
    """Share of the groups of frames that are shown without how the garment lay at the beginning."""
    precision: Precision = "float32"
    """Of products of the lag network while it is trained."""
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
        """Of proxies."""
        return ProxySize(self.edge, self.fewest, self.most)
