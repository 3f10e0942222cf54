"""Options of AgentDress."""

from dataclasses import dataclass
from typing import Any, Literal

from hemline.options import check_options, not_negative, positive


@dataclass(frozen=True)
class AgentDressConfig:
    """Options of the fit, and of how it plays."""

    pose_model: Literal["kernel", "sor"] = "kernel"
    """What tells the garment on the mean shape: a kernel regression over the poses; or sensitivity-optimised rigging,
    which the paper uses, and which wants a dataset that was draped with --derivatives."""
    shape_components: int = positive(5)
    """Principal components of the garment over body shapes, at rest, and of each anchor that is blended."""
    shape_ridge: float = positive(0.2)
    """Ridge of the regression from the shape of the body to them."""
    shape_model: Literal["kernel", "blended"] = "kernel"
    """What the shape adds in a pose: kernel regression over pose and shape together, or, as in the paper, the shape
    models of the nearest anchors, blended."""
    pose_modes: int = positive(64)
    """Modes of the basis in which the pose model speaks."""
    shape_modes: int = positive(64)
    """Modes of the basis that all anchors share for what the shape does."""
    mirror: bool = True
    """Learn from the mirror images of all drapes, too, where garment and body are symmetric. Kernels alone do."""
    neighbours: int = positive(5)
    """Anchors of a region that are blended, by a shape model that is `blended` and by rigging; so are the two below."""
    power: float = positive(3.0)
    """The higher, the more the nearest one counts."""
    floor: float = positive(0.02)
    """Added to squared distances, as a share of their median between anchors."""
    decay_seconds: float = not_negative(0.05)
    """Time constant with which the pose is followed."""
    clearance: float = not_negative(0.0)
    """Where the garment lies closer to the skin than in the anchors, it is moved out to that, at most this far [m]; the
    paper has 0.005. 0: it is not, as the player moves it out of the body in any case, and tears it less."""

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_options(self)

    @property
    def by_kernels(self) -> bool:
        """Whether kernels tell both pose and shape: they alone learn from other materials, and from mirror images."""
        return self.pose_model == self.shape_model == "kernel"

    @property
    def blending(self) -> dict[str, Any]:
        """What `distances.anchor_weights` asks for."""
        return {"neighbours": self.neighbours, "power": self.power, "floor": self.floor}
