"""Edges of a triangle mesh."""

import numpy as np

from hemline.arrays import Faces, Int


def edges(faces: Faces) -> Int[np.ndarray, "edges 2"]:
    """Returns each undirected edge once, its smaller vertex first, sorted.

    Args:
        faces: Triangles.

    Returns:
        Vertex pairs, int32.

    Example:
        >>> edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
        [[0, 1], [0, 2], [1, 2], [1, 3], [2, 3]]
    """
    return np.unique(np.sort(directed_edges(faces), axis=1), axis=0).astype(np.int32)


def directed_edges(faces: Faces) -> Int[np.ndarray, "corners 2"]:
    """Returns the directed edges of each triangle: all first ones, then all second, then all third."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def rim_edges(faces: Faces) -> Int[np.ndarray, "rim_edges 2"]:
    """Returns the directed edges that belong to one triangle only, in the order of `directed_edges`.

    Example:
        >>> rim_edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()
        [[0, 1], [1, 3], [2, 0], [3, 2]]
    """
    directed = directed_edges(faces)
    _, index, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    return directed[np.sort(index[count == 1])]
