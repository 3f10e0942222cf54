"""Winding numbers of closed meshes, exact to rounding."""

import numpy as np

from hemline.arrays import Bool, Faces, Int, Points, Vertices
from hemline.errors import BadMesh

from .winding_kernels import ColumnGrid, add_crossings, bin_points


def winding_numbers(body_vertices: Vertices, faces: Faces, points: Points) -> Int[np.ndarray, " points"]:
    r"""Returns how often a closed mesh winds around each point.

    The number is 0 outside, 1 inside, 2 where two parts of the mesh overlap, and -1 where it is turned inside out. It
    counts the faces that a ray along +z leaves through minus those it enters through. Both faces at an edge evaluate
    the same side test, so the count is right for every point that is not within rounding of the surface.

    Args:
        body_vertices: Positions of the mesh [m].
        faces: Triangles of the mesh, counter-clockwise from outside. Every directed edge needs its opposite.
        points: Points to test [m].

    Returns:
        Winding numbers, int32.

    Raises:
        BadMesh: Vertices or points are not finite.

    Example:
        >>> corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
        >>> faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32)
        >>> winding_numbers(corners, faces, np.array([[0.1, 0.1, 0.1], [1, 1, 1]], np.float32)).tolist()
        [1, 0]

    Source: Sunday, "Inclusion of a point in a polygon", 2001 (crossings as signed turns), once for
        each projected triangle.
    """
    vertices, where = (np.ascontiguousarray(each, np.float64).reshape(-1, 3) for each in (body_vertices, points))
    if not (np.isfinite(vertices).all() and np.isfinite(where).all()):
        raise BadMesh("winding numbers need finite positions", "NaN or infinity", "repair the mesh or the points")
    winding = np.zeros(len(where), np.int32)
    if not len(vertices) or not len(where) or not len(faces):
        return winding
    low, high = vertices[:, :2].min(0), vertices[:, :2].max(0)
    cell = max(float(np.sqrt(np.prod(high - low) / 20_000)), float((high - low).max() / 1_000), 1e-9)
    columns, rows = (int(count) for count in (high - low) // cell + 1)
    start, order = np.empty(rows * columns + 1, np.int64), np.empty(len(where), np.int64)
    grid = ColumnGrid(low, cell, columns, rows, start, order)
    bin_points(where, grid)
    add_crossings(vertices, np.ascontiguousarray(faces, np.int32), where, grid, winding)
    return winding


def inside(body_vertices: Vertices, faces: Faces, points: Points) -> Bool[np.ndarray, " points"]:
    """Tells which points are inside a posed body: the winding number of its mesh exceeds 0.5.

    This is the meaning of "inside" everywhere in this library. The projection promises more, a winding number of 0: in
    the fold of a limb a mesh may be turned inside out, and the winding number there is negative.

    Args:
        body_vertices: Positions of the mesh [m].
        faces: Triangles of the mesh, counter-clockwise from outside.
        points: Points to test [m].

    Returns:
        True where the winding number, a whole number, exceeds 0.5.

    Raises:
        BadMesh: Vertices or points are not finite.
    """
    return winding_numbers(body_vertices, faces, points) > 0.5
