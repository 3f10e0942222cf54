"""What many takes have in common: a garment, a body, settings; sent to each worker once."""

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
    """A garment on a body, and how it is simulated; arrays alone, so that a worker needs no file of ours."""

    garment: Garment
    body: "Body"
    settings: SimSettings

    @classmethod
    def of(cls, garment: Garment, settings: SimSettings | None) -> "Setup":
        """On the body that the garment was made on."""
        return cls(garment, bodies.load(garment.body_name), settings or SimSettings())


@functools.lru_cache(maxsize=4)
def shaped(setup: Setup, betas: tuple[float, ...]) -> "ShapedBody":
    """The body in a shape: what is prepared for it, such as the balls that untangling fills it with, is kept."""
    return setup.body.shaped(betas)


@functools.lru_cache(maxsize=64)
def drape(setup: Setup, betas: tuple[float, ...]) -> Rest:
    """Where all walks of the garment on a shape begin."""
    return rest_state(setup.garment, setup.body.shaped(betas), setup.settings)
