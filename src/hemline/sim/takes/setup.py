"""The setup that many takes share: garment, body and settings, sent to each worker once."""

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING

from hemline import bodies
from hemline.garments.garment import Garment
from hemline.sim.rest.rest import Rest
from hemline.sim.rest.settle import rest_state
from hemline.sim.settings import SimSettings

if TYPE_CHECKING:
    from hemline.bodies import Body, ShapedBody


@dataclass(frozen=True, eq=False)
class Setup:
    """A garment on a body, with the settings of the simulator. It holds only arrays, so that a worker needs none of our
    files.
    """

    garment: Garment
    body: "Body"
    settings: SimSettings

    @classmethod
    def of(cls, garment: Garment, settings: SimSettings | None) -> "Setup":
        """Makes the setup with the body that the garment was made on."""
        return cls(garment, bodies.load(garment.body_name), settings or SimSettings())


@functools.lru_cache(maxsize=4)
def shaped_body(setup: Setup, betas: tuple[float, ...]) -> "ShapedBody":
    """Returns the body in a shape, cached with everything prepared for it, such as the balls for untangling."""
    return setup.body.shaped(betas)


@functools.lru_cache(maxsize=64)
def drape(setup: Setup, betas: tuple[float, ...]) -> Rest:
    """Returns the rest drape of the garment on a shape, where all walks begin."""
    return rest_state(setup.garment, setup.body.shaped(betas), setup.settings)
