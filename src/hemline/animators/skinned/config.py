"""Options of `skinned`, which moves a garment with the body's skin."""

from dataclasses import dataclass

from hemline.garments.proxy.proxy import ProxySize
from hemline.options import check_options, positive


@dataclass(frozen=True)
class SkinnedConfig:
    """Options of `skinned`. They describe the coarse copy of the garment that settles on each body.

    Raises:
        BadInput: An option is out of its range, such as an edge of length 0.
    """

    edge: float = positive(0.035)
    """Edge length of the coarse copy [m]."""
    fewest: int = positive(500)
    """Minimum number of vertices of the coarse copy. A garment with fewer vertices settles itself."""
    most: int = positive(1500)
    """Maximum number of vertices of the coarse copy."""

    def __post_init__(self) -> None:
        check_options(self)

    @property
    def size(self) -> ProxySize:
        """Limits of the size of the coarse copy."""
        return ProxySize(self.edge, self.fewest, self.most)
