"""The named view from which most of a garment is seen."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import AnyFaces, AnyVertices

from . import picture_kernels as kernels
from .camera import view_axes

AUTO = "auto"
"""In place of a view's name: the one from which most of the garment is seen."""

PREFERRED_VIEWS = ("three_quarter", "front", "back_three_quarter", "back", "side")
"""Views in the order in which they are taken where they show alike."""

SIMILAR_AREA = 0.75
"""Share of the largest area seen from which on a view shows as much."""

_GRID = 96

Mesh = tuple[AnyVertices, AnyFaces]
"""Vertices [m] and triangles."""


def clearest_view(frames: Sequence[tuple[Sequence[Mesh], Sequence[Mesh]]]) -> str:
    """The name of the view from which most of a garment is seen, over some frames.

    Of the views that show at least three quarters of what the best one does, the first in `PREFERRED_VIEWS`.

    Args:
        frames: In each frame the meshes of the garment, and those that may hide it.

    Example:
        >>> wall = np.array([[-1, 0, 0], [1, 0, 0], [0, 2, 0]], np.float32), np.array([[0, 1, 2]], np.int32)
        >>> chest = 0.3 * wall[0] + np.float32([0, 0.5, 0.2]), wall[1]
        >>> clearest_view([([chest], [wall])])
        'front'
    """
    areas = {name: sum(visible_area(*frame, name) for frame in frames) for name in PREFERRED_VIEWS}
    return next(name for name in PREFERRED_VIEWS if areas[name] >= SIMILAR_AREA * max(areas.values()))


def visible_area(cloth: Sequence[Mesh], others: Sequence[Mesh], view: str) -> float:
    """Area of the picture that cloth fills, seen from far away in the direction of a view [m^2].

    Args:
        cloth: Meshes of the garment.
        others: Meshes that may hide it.
        view: One of `VIEWS_DEG`.
    """
    meshes = [*cloth, *others]
    if not meshes:
        return 0.0
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])[:-1]
    faces = np.concatenate([each + start for (_, each), start in zip(meshes, starts, strict=True)]).astype(np.int32)
    seen = np.concatenate([vertices for vertices, _ in meshes]).astype(np.float64) @ view_axes(view).T
    low, high = seen.min(axis=0), seen.max(axis=0)
    pixel = max(float((high - low)[:2].max()) / _GRID, 1e-9)
    screen = np.concatenate([(seen[:, :2] - low[:2]) / pixel, seen[:, 2:] - low[2] + 1], axis=1).astype(np.float32)
    depth, nearest = np.zeros((_GRID, _GRID), np.float32), np.full((_GRID, _GRID), -1, np.int32)
    kernels.rasterise(screen, np.ascontiguousarray(faces), depth, nearest)
    of_cloth = sum(len(each) for _, each in cloth)
    return float(((nearest >= 0) & (nearest < of_cloth)).sum()) * pixel**2
