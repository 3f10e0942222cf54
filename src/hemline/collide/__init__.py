"""The body as an obstacle: distances for ropes, winding numbers, whole cloth, cover, and the final projection."""

from .close.close_cloth import CloseCloth as CloseCloth
from .cover.cover import Cover as Cover
from .layers.layered_projector import LayeredProjector as LayeredProjector
from .layers.layered_projector import LayersReport as LayersReport
from .layers.layered_projector import LayersState as LayersState
from .projection.prepared import Guarantee as Guarantee
from .projection.prepared import ProjectionSettings as ProjectionSettings
from .projection.prepared import ProjectorState as ProjectorState
from .projection.project import Projector as Projector
from .projection.project_frame import ProjectionReport as ProjectionReport
from .surface.garment_on_body import GarmentOnBody as GarmentOnBody
from .surface.nearest_skin import NearestSkin as NearestSkin
from .surface.patches import limb_of_vertices as limb_of_vertices
from .surface.patches import limbs as limbs
from .surface.posed_surface import PosedSurface as PosedSurface
from .whole.length_limits import LengthLimits as LengthLimits
from .whole.whole_cloth import WholeCloth as WholeCloth
from .whole.whole_cloth import WholeSettings as WholeSettings
from .whole.whole_cloth import WholeState as WholeState
from .winding.numbers import inside as inside
from .winding.numbers import winding_numbers as winding_numbers

__all__ = [
    "CloseCloth",
    "Cover",
    "GarmentOnBody",
    "Guarantee",
    "LayeredProjector",
    "LayersReport",
    "LayersState",
    "LengthLimits",
    "NearestSkin",
    "PosedSurface",
    "ProjectionReport",
    "ProjectionSettings",
    "Projector",
    "ProjectorState",
    "WholeCloth",
    "WholeSettings",
    "WholeState",
    "inside",
    "limb_of_vertices",
    "limbs",
    "winding_numbers",
]
