"""Options of the fit of `lag`."""

from dataclasses import dataclass
from typing import ClassVar, Literal

from hemline.animators.coarse.config import CoarseConfig
from hemline.options import not_negative, positive

Precision = Literal["float32", "bfloat16"]


@dataclass(frozen=True)
class LagConfig(CoarseConfig):
    """Options of the fit of `lag`.

    Raises:
        BadInput: An option is out of its range, such as a width of 0.
    """

    SIZES: ClassVar[tuple[str, ...]] = (*CoarseConfig.SIZES, "width")

    width: int = positive(128)
    """Number of units of each hidden layer."""
    vertices: int = positive(384)
    """Number of vertices of each garment per training step, the end points of half as many edges."""
    edge_weight: float = not_negative(0.3)
    """Loss weight of the error of edge vectors, in edge lengths, beside that of vertices."""
    precision: Precision = "float32"
    """Number format of matrix products during training: float32 or bfloat16."""
    device: str = "cpu"
    """Device to train on: cpu, or cuda if PyTorch finds a GPU."""
