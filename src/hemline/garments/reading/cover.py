"""Coarse cloth laid over the body, so that skin does not come through between its vertices."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Mask, Vertices
from hemline.meshes import ClosestPoints, ClosestTree, boundary_loops, vertex_normals

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

GAP = 0.001
"""Least height of a triangle over the body's vertices beneath it [m]."""

_REACH = 0.01
_ALIKE = 0.7
_ROUNDS = 20


def covering(vertices: Vertices, faces: Faces, body: "ShapedBody") -> tuple[Vertices, tuple[str, ...]]:
    """Cloth raised along its normals until the skin beneath its triangles is beneath, and a note that says how much.

    Beneath are vertices of the body within 1 cm that look the same way and are not beyond a rim. To raise a point with
    barycentric weights w by h, each corner is raised by h w / |w|^2.

    Args:
        vertices: Cloth, already outside of the body with its vertices [m].
        faces: Triangles, outward.
        body: The body at rest.
    """
    result = np.array(vertices, np.float64)
    points, looks = np.asarray(body.vertices, np.float64), np.asarray(body.normals, np.float64)
    near = ClosestTree(result, faces).closest(points).distances < 3 * _REACH
    points, looks = points[near], looks[near]
    found = 0
    for turn in range(_ROUNDS):
        tree = ClosestTree(result, faces)
        closest = tree.closest(points)
        outward = tree.outward(closest)
        missing = ((points - closest.positions) * outward).sum(axis=1) + GAP
        beneath = ((looks * outward).sum(axis=1) > _ALIKE) & ~_beyond(closest, faces, len(result))
        through = beneath & (missing > 1e-6) & (closest.distances < _REACH)
        found = int((through & (missing > GAP)).sum()) if turn == 0 else found
        if not through.any():
            break
        weights = closest.weights[through]
        raised = missing[through, None] * weights / (weights**2).sum(axis=1, keepdims=True)
        height = np.zeros(len(result))
        np.maximum.at(height, faces[closest.faces[through]], raised)
        result += height[:, None] * vertex_normals(result, faces)
    most = float(np.linalg.norm(result - vertices, axis=1).max())
    if not most:
        return result, ()
    return result, (
        f"{found} vertices of the body came through triangles; the cloth was raised by up to {1000 * most:.1f} mm",
    )


def _beyond(closest: ClosestPoints, faces: Faces, count: int) -> Mask:
    """Which points are nearest to a rim."""
    on_rim = np.zeros(count, bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    return np.all(on_rim[faces[closest.faces]] | (closest.weights <= 0), axis=1)
