"""Settles a garment on many shapes."""

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
    """Settles a garment on many shapes of one body in one pose, each from the settled shape nearest to it.

    Args:
        garment: The garment.
        bodies: The shapes.
        pose: Pose of the bodies; None for the rest pose of each.
        settings: Settings of the simulator; the wind is ignored.
        start: A settled state to begin with.
        tolerance: See `settle`.

    Returns:
        The settled garment on each shape, in the order of `bodies`.

    Raises:
        BadInput: There are no shapes, or an input is refused by `settle`.
        SimulationFailed: No equilibrium was found on one of the shapes.
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
        distances = np.array([[np.linalg.norm(bodies[index].betas - origin) for origin in origins] for index in left])
        row, column = np.unravel_index(int(distances.argmin()), distances.shape)
        index = left[row]
        near = settled[column] if settled else None
        results[index] = settle(garment, bodies[index], pose, settings, start=near, tolerance=tolerance)
        settled.append(results[index])
    return [results[index] for index in range(len(bodies))]
