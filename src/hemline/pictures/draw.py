"""Pictures of meshes in one call."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices, Faces, Vertices

from .camera import frame_points
from .images import side_by_side, write_png
from .render import BODY, CLOTH, TRUTH, Picture, ShadedSurface, check_surface, render
from .view import AUTO, clearest_view

_NAMED_COLOURS = {"cloth": CLOTH, "body": BODY, "truth": TRUTH}


def picture_of(
    meshes: Sequence[tuple[AnyVertices, AnyFaces, str | tuple[float, float, float]]],
    view: str | Sequence[str] = AUTO,
    *,
    size: tuple[int, int] = (640, 640),
    ground: float | str | None = "lowest",
) -> Picture:
    """Renders meshes so that everything is in view; several views are joined in a row.

    Args:
        meshes: Tuples of vertices [m], faces and colour: `"cloth"`, `"body"`, `"truth"` or sRGB from 0 to 1.
        view: One or several names of `VIEWS_DEG`, or `"auto"` for the view that shows most of the meshes that are not
            `"body"`.
        size: Width and height of one view [pixels].
        ground: Height of the ground plane [m], None for no ground, or `"lowest"` for the lowest vertex.

    Raises:
        BadInput: See `frame_points` and `render`.
    """
    surfaces = [surface_of(*mesh) for mesh in meshes]
    points = np.concatenate([surface.vertices for surface in surfaces])
    height = float(np.nanmin(points[:, 1])) if isinstance(ground, str) else ground
    views = [_view_name(each, meshes, surfaces) for each in ([view] if isinstance(view, str) else view)]
    pictures = [render(surfaces, frame_points(points, each, size=size), size, ground=height) for each in views]
    return side_by_side(pictures)


def draw(
    path: str | Path,
    meshes: Sequence[tuple[AnyVertices, AnyFaces, str | tuple[float, float, float]]],
    view: str | Sequence[str] = AUTO,
    *,
    size: tuple[int, int] = (640, 640),
    ground: float | str | None = "lowest",
) -> None:
    """Writes the picture of `picture_of` as PNG.

    Raises:
        BadInput: See `picture_of`.
        BadOutput: The path cannot be written.

    Example:
        >>> import tempfile
        >>> triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2]], np.int32)
        >>> draw(tempfile.mkdtemp() + "/triangle.png", [(*triangle, "cloth")], view=["front", "back"])
    """
    write_png(path, picture_of(meshes, view, size=size, ground=ground))


def _view_name(
    view: str, meshes: Sequence[tuple[AnyVertices, AnyFaces, object]], surfaces: Sequence[ShadedSurface]
) -> str:
    """Returns the name of a view; `"auto"` becomes the view that shows most of the garment."""
    if view != AUTO:
        return view
    for surface in surfaces:
        check_surface(surface)
    cloth, bodies = (
        [
            (part.vertices, part.faces)
            for part, mesh in zip(surfaces, meshes, strict=True)
            if is_body == (mesh[2] == "body")
        ]
        for is_body in (False, True)
    )
    return clearest_view([(cloth, bodies) if cloth else (bodies, [])])


def surface_of(vertices: Vertices, faces: Faces, colour: str | tuple[float, float, float]) -> ShadedSurface:
    """Returns a surface in a colour, sRGB or one of `"cloth"`, `"body"` and `"truth"`."""
    rgb = _NAMED_COLOURS[colour] if isinstance(colour, str) else colour
    body = colour == "body"
    return ShadedSurface(
        np.asarray(vertices, np.float32),
        np.asarray(faces, np.int32),
        rgb,
        sheen=0.0 if body else 0.08,
        inside=(0.9, 0.35, 0.9) if body else ShadedSurface.inside,
    )
