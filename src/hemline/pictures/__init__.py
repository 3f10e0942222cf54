"""Pictures without a display: a small rasteriser, cameras that frame a clip, PNG and animated WebP."""

from .camera import VIEWS_DEG as VIEWS_DEG
from .camera import Camera as Camera
from .camera import frame_clip as frame_clip
from .camera import frame_points as frame_points
from .camera import view_axes as view_axes
from .compare import compare as compare
from .compare import comparison as comparison
from .draw import draw as draw
from .draw import picture_of as picture_of
from .images import add_caption as add_caption
from .images import side_by_side as side_by_side
from .images import write_png as write_png
from .images import write_webp as write_webp
from .render import BODY as BODY
from .render import CLOTH as CLOTH
from .render import TRUTH as TRUTH
from .render import ShadedSurface as ShadedSurface
from .render import linear as linear
from .render import render as render
from .view import AUTO as AUTO
from .view import clearest_view as clearest_view

__all__ = [
    "AUTO",
    "BODY",
    "CLOTH",
    "TRUTH",
    "VIEWS_DEG",
    "Camera",
    "ShadedSurface",
    "add_caption",
    "clearest_view",
    "compare",
    "comparison",
    "draw",
    "frame_clip",
    "frame_points",
    "linear",
    "picture_of",
    "render",
    "side_by_side",
    "view_axes",
    "write_png",
    "write_webp",
]
