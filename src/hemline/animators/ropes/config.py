"""Options of a fit."""

from dataclasses import dataclass, fields

from hemline.errors import BadInput


@dataclass(frozen=True)
class RopesConfig:
    """How rope chains and their two networks are fitted."""

    chains: int = 10
    """Rope chains laid on a garment that names none itself."""
    calibrate: bool = True
    """Fit the constants of the ropes to the simulated bones first."""
    components: int = 100
    """Principal components of the skinning network."""
    shape_components: int = 100
    """Principal components of the shape network."""
    second_columns: int = 8
    """Modes of the skinning basis that get 16 bits instead of 8."""
    hidden: int = 500
    """Neurons in each of the two hidden layers."""
    epochs: int = 200
    """Passes over the data of each network."""
    batch: int = 128
    """Frames a step of the optimiser."""
    skinning_rate: float = 1e-4
    """First learning rate of Adam for the skinning network; a cosine takes it to zero."""
    shape_rate: float = 1e-5
    """The same for the shape network."""
    data_weight: float = 0.1
    """Weight of the mean square distance to the truth."""
    collision_weight: float = 0.5
    """Weight of the mean square of what vertices lack to be clear of the body."""
    expansion: float = 0.005
    """Distance that vertices should keep from the body in the collision term [m]."""
    collision_vertices: int = 256
    """Vertices drawn for the collision term in each step."""
    bone_noise: float = 0.01
    """Standard deviation of noise on the simulated bones during training [m]."""
    mirror: bool = True
    """Show each training frame with left and right exchanged, too, if garment and body are symmetric."""
    bridge_hidden: int = 128
    """Neurons in each of the two hidden layers of the network between ropes and cloth."""
    bridge_epochs: int = 60
    """Passes over the data of that network."""
    bridge_rate: float = 5e-4
    """Its first learning rate."""
    bridge_collision_weight: float = 30.0
    """Its weight of the mean square of what vertices lack."""
    loyalty: float = 0.1
    """Its weight of the mean square distance from what the ropes' bones would make without it."""
    checkpoint_epochs: int = 10
    """The state of the training is kept every so many passes."""
    threads: int = 2
    """Threads of the training."""

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if each.type in (bool, "bool"):
                if not isinstance(value, bool):
                    raise BadInput(f"option '{each.name}' is a switch", repr(value), "use true or false")
            elif each.type in (int, "int"):
                least = 0 if each.name == "second_columns" else 1
                if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= 100_000:
                    cure = f"use a whole number from {least} to 100000"
                    raise BadInput(f"option '{each.name}' is a count", repr(value), cure)
            elif not isinstance(value, int | float) or not 0 <= value < 1e6:
                raise BadInput(f"option '{each.name}' is a finite number", repr(value), "use one that is not negative")
