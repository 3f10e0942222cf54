"""One call to look at something."""

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
    """A picture of meshes, framed so that all is seen; several views come out in a row.

    Args:
        meshes: (vertices [m], faces, colour) each; colour `"cloth"`, `"body"`, `"truth"` or sRGB from 0 to 1.
        view: One name of `VIEWS_DEG`, or several; `"auto"`: that from which most is seen of what is not `"body"`.
        size: Width and height of one view [pixels].
        ground: Height of the ground plane [m], None for none, or `"lowest"`: at the lowest vertex.

    Raises:
        BadInput: As `frame_points` and `render`.
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
    """Write `picture_of` these meshes as PNG.

    Raises:
        BadInput: As `picture_of`.
        BadOutput: The path cannot be written.

    Example:
        >>> import tempfile
        >>> triangle = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32), np.array([[0, 1, 2]], np.int32)
        >>> draw(tempfile.mkdtemp() + "/triangle.png", [(*triangle, "cloth")], view=["front", "back"])
    """
    write_png(path, picture_of(meshes, view, size=size, ground=ground))


def _view_name(view: str, meshes: Sequence[tuple[AnyVertices, AnyFaces, object]], surfaces: Sequence[ShadedSurface]) -> str:
    """The view's own name, or that from which most of the garment is seen."""
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
    """A surface in a colour, where `"cloth"`, `"body"` and `"truth"` name the usual ones."""
    rgb = _NAMED_COLOURS[colour] if isinstance(colour, str) else colour
    body = colour == "body"
    return ShadedSurface(
        np.asarray(vertices, np.float32),
        np.asarray(faces, np.int32),
        rgb,
        sheen=0.0 if body else 0.08,
        inside=(0.9, 0.35, 0.9) if body else ShadedSurface.inside,
    )
