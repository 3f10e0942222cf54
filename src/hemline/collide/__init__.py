"""The body as an obstacle: analytic distances for ropes, winding numbers, and the final projection of cloth."""

from .patches import limb_of_vertices as limb_of_vertices
from .patches import limbs as limbs
from .project import ProjectionReport as ProjectionReport
from .project import ProjectionSettings as ProjectionSettings
from .project import Projector as Projector
from .project import ProjectorState as ProjectorState
from .winding import inside as inside
from .winding import winding_numbers as winding_numbers

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
