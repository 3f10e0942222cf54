"""A picture of a frame beside the simulated one, with their difference."""

from pathlib import Path

import numpy as np

from hemline.arrays import BodyFaces, BodyVertices, Faces, Float, Vertices
from hemline.errors import BadInput

from .camera import frame_points
from .draw import surface_of
from .images import add_caption, write_png
from .render import Picture, ShadedSurface, render

_VIEWS = ("three_quarter", "back_three_quarter")
_SCALE = np.array([(0.90, 0.90, 0.87), (0.98, 0.80, 0.38), (0.85, 0.26, 0.16), (0.32, 0.02, 0.14)])
"""sRGB at 0, 1/3, 2/3 and 1 of the colour scale."""


def compare(
    path: str | Path,
    ours: Vertices,
    truth: Vertices | None,
    faces: Faces,
    *,
    body: tuple[BodyVertices, BodyFaces] | None = None,
    size: tuple[int, int] = (480, 600),
) -> None:
    """Writes a PNG of one frame from two sides: the truth, the animated garment, and that one coloured by its error.

    Args:
        path: Path of the PNG.
        ours: The garment as animated [m].
        truth: The garment as simulated [m]; without it, only ours is drawn.
        faces: Triangles of the garment.
        body: Vertices [m] and faces of the posed body.
        size: Width and height of each view [pixels].

    Raises:
        BadInput: `ours` and `truth` differ in shape, or hold NaN.
        BadOutput: The path cannot be written.
    """
    write_png(path, comparison(ours, truth, faces, body=body, size=size))


def comparison(
    ours: Vertices,
    truth: Vertices | None,
    faces: Faces,
    *,
    body: tuple[BodyVertices, BodyFaces] | None = None,
    size: tuple[int, int] = (480, 600),
) -> Picture:
    """Returns the picture that `compare` writes.

    Raises:
        BadInput: See `compare`.
    """
    ours = np.asarray(ours, np.float32)
    under = [] if body is None else [surface_of(*body, "body")]
    columns = [("ours", surface_of(ours, faces, "cloth"))]
    if truth is not None:
        if np.shape(truth) != ours.shape:
            got = f"{ours.shape} and {np.shape(truth)}"
            raise BadInput("a frame and its truth must have the same vertices", got, "take both from one garment")
        error_mm = 1e3 * np.linalg.norm(ours - truth, axis=1)
        limit_mm = max(1.0, float(np.percentile(error_mm, 99)))
        colours, faces = scale_colours(error_mm / limit_mm), np.asarray(faces, np.int32)
        coloured = ShadedSurface(ours, faces, inside=(1.0, 1.0, 1.0), sheen=0.0, colours=colours)
        caption = f"mean {error_mm.mean():.1f}, p95 {np.percentile(error_mm, 95):.1f}, max {error_mm.max():.1f} mm"
        columns = [("truth", surface_of(truth, faces, "truth")), *columns, (caption, coloured)]
    points = np.concatenate([surface.vertices for surface in [*under, *(surface for _, surface in columns)]])
    ground = float(points[:, 1].min())
    rows = []
    for view in _VIEWS:
        camera = frame_points(points, view, size=size)
        rows.append([render([*under, surface], camera, size, ground=ground) for _, surface in columns])
    rows[-1] = [add_caption(picture, caption) for picture, (caption, _) in zip(rows[-1], columns, strict=True)]
    if truth is not None:
        rows[0][-1] = _with_scale(rows[0][-1], limit_mm)
    return np.concatenate([np.concatenate(row, axis=1) for row in rows], axis=0)


def scale_colours(values: Float[np.ndarray, " verts"]) -> Float[np.ndarray, "verts 3"]:
    """Returns sRGB colours from pale through yellow and red to dark for values from 0 to 1, clamped beyond."""
    stops = np.linspace(0, 1, len(_SCALE))
    return np.stack([np.interp(values, stops, channel) for channel in _SCALE.T], axis=1).astype(np.float32)


def _with_scale(picture: Picture, limit_mm: float) -> Picture:
    height, width = picture.shape[:2]
    bar_height, bar_width, rim = height // 3, max(8, width // 40), height // 30
    bar = np.repeat(scale_colours(np.linspace(1, 0, bar_height))[:, None], bar_width, axis=1)
    labelled = _label(_label(picture.copy(), f"{limit_mm:.0f} mm", rim, bar_width), "0", rim + bar_height, bar_width)
    labelled[rim : rim + bar_height, width - rim - bar_width : width - rim] = np.round(255 * bar)
    return labelled


def _label(picture: Picture, text: str, top: int, bar_width: int) -> Picture:
    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(picture)
    size, right = max(11, picture.shape[0] // 36), picture.shape[1] - picture.shape[0] // 30 - bar_width
    draw = ImageDraw.Draw(image)
    draw.text((right - 8, top), text, fill=(60, 60, 64), font=ImageFont.load_default(size), anchor="rm")
    return np.array(image)
