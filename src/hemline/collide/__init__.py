"""The body as an obstacle: analytic distances for ropes, winding numbers, and the final projection of cloth."""

from .projection.patches import limb_of_vertices as limb_of_vertices
from .projection.patches import limbs as limbs
from .projection.project import ProjectionReport as ProjectionReport
from .projection.project import ProjectionSettings as ProjectionSettings
from .projection.project import Projector as Projector
from .projection.project import ProjectorState as ProjectorState
from .winding.numbers import inside as inside
from .winding.numbers import winding_numbers as winding_numbers

__all__ = [
    "ProjectionReport",
    "ProjectionSettings",
    "Projector",
    "ProjectorState",
    "inside",
    "limb_of_vertices",
    "limbs",
    "winding_numbers",
]
"""Names of the room; rounded cones and the like are in `proxy` and `primitives`."""
