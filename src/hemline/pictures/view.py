"""Choice of the view that shows most of a garment."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices

from . import picture_kernels as kernels
from .camera import view_axes

AUTO = "auto"
"""Name that stands for the view that shows most of the garment."""

PREFERRED_VIEWS = ("three_quarter", "front", "back_three_quarter", "back", "side")
"""Views in order of preference, where they show similar areas."""

SIMILAR_AREA = 0.75
"""Fraction of the largest visible area from which on a view counts as similar."""

_GRID = 96

Mesh = tuple[AnyVertices, AnyFaces]
"""Vertices [m] and triangles."""


def clearest_view(frames: Sequence[tuple[Sequence[Mesh], Sequence[Mesh]]]) -> str:
    """Returns the name of the view that shows most of a garment over some frames.

    Among views that show at least three quarters of the largest area, the first of `PREFERRED_VIEWS` is chosen.

    Args:
        frames: For each frame, the meshes of the garment and the meshes that may hide it.

    Example:
        >>> wall = np.array([[-1, 0, 0], [1, 0, 0], [0, 2, 0]], np.float32), np.array([[0, 1, 2]], np.int32)
        >>> chest = 0.3 * wall[0] + np.float32([0, 0.5, 0.2]), wall[1]
        >>> clearest_view([([chest], [wall])])
        'front'
    """
    areas = {name: sum(visible_area(*frame, name) for frame in frames) for name in PREFERRED_VIEWS}
    return next(name for name in PREFERRED_VIEWS if areas[name] >= SIMILAR_AREA * max(areas.values()))


def visible_area(cloth: Sequence[Mesh], others: Sequence[Mesh], view: str) -> float:
    """Returns the visible area of cloth from far away in the direction of a view [m^2].

    Args:
        cloth: Meshes of the garment.
        others: Meshes that may hide the garment.
        view: One of `VIEWS_DEG`.
    """
    meshes = [*cloth, *others]
    if not meshes:
        return 0.0
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])[:-1]
    faces = np.concatenate([each + start for (_, each), start in zip(meshes, starts, strict=True)]).astype(np.int32)
    in_view = np.concatenate([vertices for vertices, _ in meshes]).astype(np.float64) @ view_axes(view).T
    low, high = in_view.min(axis=0), in_view.max(axis=0)
    pixel = max(float((high - low)[:2].max()) / _GRID, 1e-9)
    screen = np.concatenate([(in_view[:, :2] - low[:2]) / pixel, in_view[:, 2:] - low[2] + 1], axis=1).astype(
        np.float32
    )
    depth, nearest = np.zeros((_GRID, _GRID), np.float32), np.full((_GRID, _GRID), -1, np.int32)
    kernels.rasterise(screen, np.ascontiguousarray(faces), depth, nearest)
    of_cloth = sum(len(each) for _, each in cloth)
    return float(((nearest >= 0) & (nearest < of_cloth)).sum()) * pixel**2
