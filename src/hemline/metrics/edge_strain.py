"""How much the edges of a garment are stretched."""

import numpy as np

from hemline.arrays import Faces, Float


def edge_strains(
    vertices: Float[np.ndarray, "*frames verts 3"], faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]
) -> Float[np.ndarray, "*frames corners"]:
    r"""Strain $\ell / \ell_0 - 1$ of the three edges of each triangle; negative where an edge is shortened.

    An inner edge counts once for each of its two triangles, whose flat rest shapes may differ.

    Args:
        vertices: The garment [m].
        faces: Its triangles.
        rest_edges: Columns: the edges from the first corner to the second and to the third of the flat rest triangle
            [m].

    Returns:
        Strains: all first edges, then all second, then all third.
    """
    first, second = rest_edges[..., 0], rest_edges[..., 1]
    rest = np.concatenate([np.linalg.norm(edge, axis=1) for edge in (first, second - first, second)])
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    vertices = np.asarray(vertices, np.float64)
    return np.linalg.norm(vertices[..., pairs[:, 1], :] - vertices[..., pairs[:, 0], :], axis=-1) / rest - 1


def edge_strain(strains: Float[np.ndarray, "*frames corners"]) -> dict[str, float]:
    """Median, 99th percentile and largest size of strains, stretched or shortened alike.

    Args:
        strains: Of `edge_strains`, of one frame or of many.

    Returns:
        `p50`, `p99`, `max` [1].
    """
    p50, p99 = np.percentile(np.abs(strains), [50, 99])
    return {"p50": float(p50), "p99": float(p99), "max": float(np.abs(strains).max())}
