"""Raises coarse cloth, so that skin does not come through its triangles between the vertices."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Faces, Mask, Vertices
from hemline.meshes import ClosestPoints, ClosestTree, boundary_loops, vertex_normals

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

LEAST_HEIGHT = 0.001
"""Least height of a triangle over the body's vertices beneath it [m]."""

_SKIN_DISTANCE = 0.01
"""Skin farther than this from the cloth does not come through it [m]."""
_SAME_DIRECTION = 0.7
"""Least cosine between the normals of cloth and the skin beneath it."""
_ROUNDS = 20


def raise_over_skin(vertices: Vertices, faces: Faces, body: "ShapedBody") -> tuple[Vertices, tuple[str, ...]]:
    """Raises cloth along its normals until all skin beneath its triangles is covered.

    Vertices of the body are beneath the cloth if they are within 1 cm, face the same way and are not beyond a rim. To
    raise a point with barycentric weights w by h, each corner is raised by h w / |w|^2.

    Args:
        vertices: Vertices of the cloth, all of them already outside of the body [m].
        faces: Triangles, wound outward.
        body: The body at rest.

    Returns:
        The raised vertices, float64 [m], and a note that says by how much.
    """
    result = np.array(vertices, np.float64)
    points, directions = np.asarray(body.vertices, np.float64), np.asarray(body.normals, np.float64)
    near = ClosestTree(result, faces).closest(points).distances < 3 * _SKIN_DISTANCE
    points, directions = points[near], directions[near]
    count = 0
    for turn in range(_ROUNDS):
        tree = ClosestTree(result, faces)
        closest = tree.closest(points)
        outward = tree.outward(closest)
        missing = ((points - closest.positions) * outward).sum(axis=1) + LEAST_HEIGHT
        beneath = ((directions * outward).sum(axis=1) > _SAME_DIRECTION) & ~_beyond(closest, faces, len(result))
        through = beneath & (missing > 1e-6) & (closest.distances < _SKIN_DISTANCE)
        count = int((through & (missing > LEAST_HEIGHT)).sum()) if turn == 0 else count
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
        f"{count} vertices of the body came through triangles; the cloth was raised by up to {1000 * most:.1f} mm",
    )


def _beyond(closest: ClosestPoints, faces: Faces, count: int) -> Mask:
    """Returns which points are nearest to a rim of the cloth."""
    on_rim = np.zeros(count, bool)
    for loop in boundary_loops(faces):
        on_rim[loop] = True
    return np.all(on_rim[faces[closest.faces]] | (closest.weights <= 0), axis=1)
