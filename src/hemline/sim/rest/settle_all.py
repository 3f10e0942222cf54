"""A garment at rest on many shapes."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from hemline.errors import BadInput
from hemline.garments.garment import Garment
from hemline.motions.motion import Pose
from hemline.sim.settings import SimSettings

from .rest import Rest
from .settle import settle

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody


def settle_all(
    garment: Garment,
    bodies: Sequence["ShapedBody"],
    pose: Pose | None = None,
    settings: SimSettings | None = None,
    *,
    start: Rest | None = None,
    tolerance: float = 0.01,
) -> list[Rest]:
    """A garment at rest on many shapes of one body in one pose, each from the settled shape nearest to it.

    Args:
        garment: The garment.
        bodies: The shapes.
        pose: Their pose; None: the rest pose of each.
        settings: Settings; the wind is ignored.
        start: A settled state to begin with.
        tolerance: As in `settle`.

    Returns:
        One a shape, in the order of `bodies`.

    Raises:
        BadInput: As in `settle`, or no shapes.
        SimulationFailed: One of them found no equilibrium.
    """
    if not len(bodies):
        raise BadInput("'bodies' must hold a shape", "none", "give at least one shaped body")
    settled: list[Rest] = [] if start is None else [start]
    results: dict[int, Rest] = {}
    own = np.zeros(len(bodies[0].betas))
    own[: len(garment.body_betas)] = garment.body_betas
    while len(results) < len(bodies):
        origins = [rest.shaped.betas for rest in settled] or [own]
        left = [index for index in range(len(bodies)) if index not in results]
        way = np.array([[np.linalg.norm(bodies[index].betas - origin) for origin in origins] for index in left])
        row, column = np.unravel_index(int(way.argmin()), way.shape)
        index = left[row]
        near = settled[column] if settled else None
        results[index] = settle(garment, bodies[index], pose, settings, start=near, tolerance=tolerance)
        settled.append(results[index])
    return [results[index] for index in range(len(bodies))]
