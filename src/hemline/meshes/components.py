"""Connected parts of a triangle mesh."""

import numpy as np

from hemline.arrays import Faces, Int

from .edges import directed_edges


def components(faces: Faces, vertex_count: int) -> Int[np.ndarray, " verts"]:
    """Returns the number of the connected part of each vertex; a vertex without triangles is a part of its own.

    Args:
        faces: Triangles.
        vertex_count: Number of vertices.

    Returns:
        Part numbers from 0 in the order of their first vertices, int32.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    start, end = directed_edges(faces).T
    graph = coo_matrix((np.ones(len(start), bool), (start, end)), (vertex_count, vertex_count))
    return connected_components(graph, directed=False)[1].astype(np.int32)


def sheets(faces: Faces) -> Int[np.ndarray, " faces"]:
    """Returns the number of the sheet of each triangle: triangles that are connected by edges, not by vertices alone.

    Args:
        faces: Triangles.

    Returns:
        Sheet numbers from 0 in the order of their first triangles, int32.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    low, high = np.sort(directed_edges(faces), axis=1).T
    order = np.lexsort((high, low))
    same = (low[order][1:] == low[order][:-1]) & (high[order][1:] == high[order][:-1])
    left, right = order[:-1][same] % len(faces), order[1:][same] % len(faces)
    graph = coo_matrix((np.ones(len(left), bool), (left, right)), (len(faces), len(faces)))
    return connected_components(graph, directed=False)[1].astype(np.int32)
