"""Options of a fit."""

from dataclasses import dataclass
from typing import Literal

from hemline.options import check_options, not_negative, positive


@dataclass(frozen=True)
class RopesConfig:
    """How rope chains and their networks are fitted.

    Raises:
        BadInput: An option of another type, not finite, or out of its range.
    """

    layout: Literal["auto", "geodesic", "ssdr"] = "auto"
    """Where bones lie: along the chains that the garment names, or else as for "geodesic"; at even distances along
    geodesic lines; or where a skinning decomposition of the takes puts them."""
    chains: int = positive(26)
    """Rope chains laid on a garment, unless it names them itself. The paper's cape has ten of 13 to 15 bones; many that
    are short tell more of the cloth between them."""
    chain_bones: int = positive(9)
    """Bones of such a chain of average length, root included; the shortest gets one less."""
    calibrate: bool = True
    """Fit the constants of the ropes to the simulated bones first."""
    gradient_steps: int = not_negative(0)
    """Steps along the gradient of the ropes' error after the search for their constants."""
    components: int = positive(100)
    """Principal components of the skinning network."""
    shape_components: int = positive(100)
    """Principal components of the shape network."""
    second_columns: int = not_negative(8)
    """Modes of the skinning basis that get 16 bits instead of 8."""
    hidden: int = positive(500)
    """Neurons in each of the two hidden layers."""
    epochs: int = positive(40)
    """Passes over the training set of each network."""
    batch: int = positive(128)
    """Frames a step of the optimiser."""
    skinning_rate: float = not_negative(1e-4)
    """First learning rate of Adam for the skinning network; a cosine takes it to zero."""
    shape_rate: float = not_negative(1e-5)
    """The same for the shape network."""
    data_weight: float = not_negative(0.1)
    """Weight of the mean square distance to the ground truth."""
    collision_weight: float = not_negative(0.1)
    """Weight of the mean square of what vertices lack to be clear of the body."""
    expansion: float = not_negative(0.005)
    """Distance that vertices should keep from the body in the collision term [m]."""
    collision_vertices: int = positive(256)
    """Vertices drawn for the collision term in each step."""
    bone_noise: float = not_negative(0.003)
    """Standard deviation of noise on the simulated bones during training [m]."""
    mirror: bool = True
    """Show each training frame with left and right exchanged, too, if garment and body are symmetric."""
    correction_hidden: int = positive(128)
    """Neurons in each of the two hidden layers of the bone correction, the network between ropes and cloth."""
    correction_epochs: int = positive(60)
    """Passes over the training set of that network."""
    correction_rate: float = not_negative(5e-4)
    """Its first learning rate."""
    correction_collision_weight: float = not_negative(30.0)
    """Its weight of the mean square of what vertices lack."""
    prior_weight: float = not_negative(0.1)
    """Its weight of the mean square distance to what the ropes' bones make without it."""
    bones: Literal["auto", "ropes", "learned"] = "auto"
    """What moves the bones: ropes, learned bones (with ropes in reserve), or what is better on validation."""
    bone_components: int = positive(64)
    """Principal components of the learned bones."""
    bones_hidden: int = positive(256)
    """Neurons in each of the two hidden layers of their network."""
    bones_epochs: int = positive(30)
    """Passes over the training set in each of the three stages of its training."""
    bones_batch: int = positive(256)
    """Rollouts a step of the optimiser."""
    bones_rate: float = not_negative(1e-3)
    """First learning rate of the first stage; each other one has half of that before."""
    rollout_frames: int = positive(40)
    """Frames of a rollout in the last stage."""
    rollout_noise: float = not_negative(0.015)
    """Standard deviation of noise on each coefficient of the bones that a rollout begins with [m]."""
    body_noise: float = not_negative(0.3)
    """Standard deviation of noise on what learned bones see of the body, as a share of the deviation of each input."""
    swing_weight: float = not_negative(10.0)
    """Weight of the mean square error of what bones move from frame to frame, beside that of where they are."""
    bone_clearance: float = not_negative(0.01)
    """Learned bones are pushed this far out of the body's primitives [m]."""
    checkpoint_epochs: int = positive(10)
    """The state of a training is kept every so many passes."""
    threads: int = positive(2)
    """Threads of the training."""

    def __post_init__(self) -> None:
        check_options(self)
