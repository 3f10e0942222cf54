"""Moves cloth out of the body at rest, and smooths displacements over a mesh."""

import numpy as np

from hemline.arrays import Faces, Float, Mask, Vertices
from hemline.meshes import ClosestTree, edges

_ROUNDS = 12


def smooth_field(
    field: Float[np.ndarray, "verts 3"], faces: Faces, trust: Float[np.ndarray, " verts"], stiffness: float
) -> Float[np.ndarray, "verts 3"]:
    """Smooths vectors over a mesh: argmin_d sum_i t_i |d_i - f_i|^2 + s sum_edges |d_i - d_j|^2.

    Args:
        field: Vectors f.
        faces: Triangles.
        trust: Weight t of each vertex's own vector.
        stiffness: Weight s of the differences between neighbours.
    """
    from scipy.sparse import coo_matrix, diags
    from scipy.sparse.linalg import splu

    start, end = edges(faces).T
    count = len(field)
    links = coo_matrix((np.full(len(start), stiffness), (start, end)), (count, count))
    links = links + links.T
    system = diags(np.asarray(links.sum(axis=1)).reshape(-1) + trust + 1e-9) - links
    return splu(system.tocsc()).solve(field * trust[:, None])


def push_out_of_body(
    vertices: Vertices, tree: ClosestTree, clearance: float, *, fixed: Mask | None = None
) -> np.ndarray:
    """Moves vertices that are inside the body, or closer to it than the clearance, outward along its normal.

    Args:
        vertices: Positions of the cloth [m].
        tree: The closed surface of the body.
        clearance: Least distance [m].
        fixed: Mask of vertices that stay where they are; None: none.

    Returns:
        Positions, float64. In a crease of the body narrower than twice the clearance, a vertex may end up closer.
    """
    result = np.array(vertices, np.float64)
    active = np.arange(len(result)) if fixed is None else np.flatnonzero(~fixed)
    for _ in range(_ROUNDS):
        closest = tree.closest(result[active])
        outward = tree.outward(closest)
        height = ((result[active] - closest.positions) * outward).sum(axis=1)
        signed = np.where(height < 0, -closest.distances, closest.distances)
        near = signed < clearance - 1e-6
        if not near.any():
            break
        # vertices outside move away from their closest point, vertices inside along the surface's normal
        away = result[active] - closest.positions
        unit = away / np.maximum(closest.distances[:, None], 1e-12)
        direction = np.where((height > 1e-6)[:, None], unit, outward)
        result[active[near]] = (closest.positions + direction * clearance * 1.0001)[near]
        active = active[near]
    return result
