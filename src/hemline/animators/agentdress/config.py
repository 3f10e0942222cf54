"""Options of the fit of `agentdress`."""

from dataclasses import dataclass
from typing import Any, Literal

from hemline.options import check_options, not_negative, positive


@dataclass(frozen=True)
class AgentDressConfig:
    """Options of the fit of `agentdress`."""

    pose_model: Literal["kernel", "sor"] = "kernel"
    """Model of the garment on the mean shape: kernel regression over poses, or sensitivity-optimised rigging (sor).
    The paper uses the latter, which needs a dataset made by drape --derivatives."""
    shape_components: int = positive(5)
    """Number of principal components of the garment over body shapes, at rest and for each blended anchor."""
    shape_ridge: float = positive(0.2)
    """Ridge penalty of the regression from body shape to these components."""
    shape_model: Literal["kernel", "blended"] = "kernel"
    """Model of the effect of body shape in a pose: kernel regression over pose and shape, or blended anchors.
    The blend of the shape models of the nearest anchors is the method of the paper."""
    pose_modes: int = positive(80)
    """Number of basis modes of the pose model."""
    shape_modes: int = positive(80)
    """Number of basis modes of shape effects, shared by all anchors."""
    mirror: bool = True
    """Train on mirror images of all drapes too, if garment and body are symmetric.
    It applies to kernel models alone."""
    neighbours: int = positive(5)
    """Number of anchors blended in each region, for --shape-model blended and --pose-model sor."""
    power: float = positive(3.0)
    """Exponent of inverse distance in the blending weights. A higher value gives more weight to the nearest anchor."""
    floor: float = positive(0.02)
    """Offset added to squared distances in the blending weights, as a fraction of their median between anchors."""
    decay_seconds: float = not_negative(0.05)
    """Time constant with which the garment follows the pose [s]. With 0 it follows at once."""

    def __post_init__(self) -> None:
        """Raises BadInput for an option out of its range."""
        check_options(self)

    @property
    def by_kernels(self) -> bool:
        """Whether both models are kernel regressions, which alone learn from other materials and from mirror images."""
        return self.pose_model == self.shape_model == "kernel"

    @property
    def blending(self) -> dict[str, Any]:
        """Arguments of `distances.anchor_weights`."""
        return {"neighbours": self.neighbours, "power": self.power, "floor": self.floor}
