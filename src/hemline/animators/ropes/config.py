"""Options of the fit of `ropes`."""

from dataclasses import dataclass
from typing import Literal

from hemline.options import check_options, not_negative, positive


@dataclass(frozen=True)
class RopesConfig:
    """Options of the fit of `ropes`.

    Raises:
        BadInput: An option has another type, is not finite, or is out of its range.
    """

    layout: Literal["auto", "geodesic", "ssdr", "scattered"] = "auto"
    """Placement of the bones: on lines from rim to hem (geodesic, ssdr), anywhere (scattered), or auto.
    With ssdr and scattered, a skinning decomposition of the takes puts the bones where cloth moves on its own.
    With auto, they follow the chains that the garment names, or else geodesic lines, or are scattered if no lines suit.
    """
    chains: int = positive(26)
    """Number of rope chains on a garment that names none.
    The paper's cape has ten chains of 13 to 15 bones; many short chains describe more of the cloth between them."""
    chain_bones: int = positive(9)
    """Number of bones of a chain of average length, root included. The shortest chain has one fewer."""
    least_swing: float = not_negative(0.03)
    """Bones on cloth that swings less against the body, as on a bodice or a sleeve, are carried by the body [m].
    Chains hang from the lowest of these. With 0, they hang from the rim, as do those that the garment names."""
    calibrate: bool = True
    """Fit the physical constants of the ropes to the simulated bones before training."""
    components: int = positive(100)
    """Number of principal components of the skinning network."""
    shape_components: int = positive(100)
    """Number of principal components of the shape network."""
    second_columns: int = not_negative(8)
    """Number of modes of the skinning basis that are stored with 16 bits instead of 8."""
    hidden: int = positive(500)
    """Number of neurons in each of the two hidden layers of the skinning and shape networks."""
    epochs: int = not_negative(0)
    """Number of passes over the training set for the skinning network and for the shape network.
    With 0 both are linear maps, and the fit needs no PyTorch. Otherwise a network is kept where it is better."""
    batch: int = positive(128)
    """Number of frames per optimiser step."""
    skinning_rate: float = not_negative(1e-4)
    """Initial learning rate of Adam for the skinning network. A cosine schedule takes it to zero."""
    shape_rate: float = not_negative(1e-5)
    """Initial learning rate of Adam for the shape network. A cosine schedule takes it to zero."""
    data_weight: float = not_negative(0.1)
    """Loss weight of the mean squared distance to the ground truth."""
    collision_weight: float = not_negative(0.1)
    """Loss weight of the collision term, the mean squared distance that vertices lack to --expansion."""
    expansion: float = not_negative(0.005)
    """Clearance from the body in the collision term [m]."""
    collision_vertices: int = positive(256)
    """Number of vertices sampled for the collision term in each step."""
    bone_noise: float = not_negative(0.003)
    """Standard deviation of the noise added to the simulated bones during training [m]."""
    mirror: bool = True
    """Train on mirror images too, with left and right exchanged, if garment and body are symmetric."""
    correction_components: int = positive(100)
    """Number of principal components of the correction of the ropes' bones."""
    checkpoint_epochs: int = positive(10)
    """Number of passes over the training set between checkpoints."""
    threads: int = positive(1)
    """Number of threads for training. Two are a fifth faster on an idle machine, many times slower on a busy one."""

    def __post_init__(self) -> None:
        check_options(self)
