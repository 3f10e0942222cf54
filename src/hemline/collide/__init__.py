"""The body as an obstacle: analytic distances for ropes, winding numbers, and the final projection of cloth."""

from .projection.patches import limb_of_vertices as limb_of_vertices
from .projection.patches import limbs as limbs
from .projection.prepared import Guarantee as Guarantee
from .projection.prepared import ProjectionSettings as ProjectionSettings
from .projection.prepared import ProjectorState as ProjectorState
from .projection.project import Projector as Projector
from .projection.project_frame import ProjectionReport as ProjectionReport
from .winding.numbers import inside as inside
from .winding.numbers import winding_numbers as winding_numbers

__all__ = [
    "Guarantee",
    "ProjectionReport",
    "ProjectionSettings",
    "Projector",
    "ProjectorState",
    "inside",
    "limb_of_vertices",
    "limbs",
    "winding_numbers",
]
