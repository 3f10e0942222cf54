"""Strains and rest lengths of edges."""

import numpy as np

from hemline.arrays import Faces, Float, Int


def edge_strains(
    vertices: Float[np.ndarray, "*frames verts 3"], faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]
) -> Float[np.ndarray, "*frames faces 3"]:
    r"""Returns the strain $\ell / \ell_0 - 1$ of the three edges of each triangle; negative where an edge is shortened.

    An inner edge counts once for each of its two triangles, whose flat rest shapes may differ.

    Args:
        vertices: Positions [m].
        faces: Triangles.
        rest_edges: Edges of the flat rest triangle from the first corner to the second and to the third, as columns
            [m].

    Returns:
        Strains of the edges 0-1, 1-2, 2-0, float64.
    """
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    return strains(np.asarray(vertices, np.float64), ends, edge_lengths(rest_edges))


def strains(
    vertices: Float[np.ndarray, "*frames verts 3"],
    edges: Int[np.ndarray, "... 2"],
    rest_lengths: Float[np.ndarray, "..."],
) -> Float[np.ndarray, "..."]:
    r"""Returns the strain $\ell / \ell_0 - 1$ of given edges, in the precision of the arguments.

    Args:
        vertices: Positions [m].
        edges: Vertices of each edge; any axes may come first.
        rest_lengths: $\ell_0$, with the same axes [m].

    Returns:
        Strains, the axes of the frames before those of the edges.
    """
    along = vertices[..., edges[..., 1], :] - vertices[..., edges[..., 0], :]
    return np.linalg.norm(along, axis=-1) / rest_lengths - 1


def rest_lengths(
    faces: Faces, rest_edges: Float[np.ndarray, "faces 2 2"]
) -> tuple[Int[np.ndarray, "edges 2"], Float[np.ndarray, " edges"]]:
    """Returns each edge once, smaller vertex first, sorted, and its length at rest [m].

    Args:
        faces: Triangles.
        rest_edges: See `edge_strains`. An edge of two triangles takes the larger of its two lengths [m].
    """
    ends = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    every, which = np.unique(ends, axis=0, return_inverse=True)
    lengths = np.zeros(len(every))
    np.maximum.at(lengths, which.reshape(-1), edge_lengths(rest_edges).reshape(-1))
    return every.astype(np.int32), lengths


def edge_lengths(rest_edges: Float[np.ndarray, "faces 2 2"]) -> Float[np.ndarray, "faces 3"]:
    """Returns the lengths of the three edges of each flat triangle: 0-1, 1-2, 2-0 [m].

    Args:
        rest_edges: See `edge_strains` [m].
    """
    first, second = rest_edges[:, :, 0], rest_edges[:, :, 1]
    return np.stack([np.linalg.norm(each, axis=1) for each in (first, second - first, second)], axis=1)


def worst_edge_ratio(
    vertices: Float[np.ndarray, "*frames verts 3"],
    edges: Int[np.ndarray, "edges 2"],
    rest_lengths: Float[np.ndarray, " edges"],
) -> Float[np.ndarray, "*frames"] | np.floating:
    r"""Returns the largest $\ell / \ell_0$ of the edges of a mesh, or of each of its frames; above 3 cloth is torn.

    Edges shorter at rest than a quarter of the median do not count: a few millimetres make slivers twice as long.

    Args:
        vertices: Positions [m].
        edges: Vertices of the edges that count, without those between two pins.
        rest_lengths: $\ell_0$ [m].

    Returns:
        The ratios, float64; 1 where there are no edges.
    """
    long = rest_lengths >= 0.25 * np.median(rest_lengths) if len(rest_lengths) else np.zeros(0, bool)
    if not long.any():
        return np.ones(np.asarray(vertices).shape[:-2])
    return 1 + strains(np.asarray(vertices, np.float64), edges[long], rest_lengths[long]).max(axis=-1)
