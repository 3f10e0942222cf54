"""Closes the holes of a body's mesh, such as the eye sockets of SMPL-X, since only closed surfaces have an inside."""

import itertools

import numpy as np

from hemline.arrays import Faces, Int


def close_holes(faces: Faces) -> Int[np.ndarray, "all_faces 3"]:
    """Returns the triangles, followed by a fan over each hole; no vertex is added.

    This needs rims that neither touch each other nor themselves. Otherwise the triangles are returned as they are, and
    code that needs a closed mesh refuses them.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).astype(np.int64)
    count = int(edges.max()) + 1
    rim = edges[~np.isin(edges[:, 1] * count + edges[:, 0], edges[:, 0] * count + edges[:, 1])]
    after = {int(end): int(start) for start, end in rim}  # along the hole's own side of its rim
    if len(rim) != len(after) or set(after) != set(after.values()):
        return faces
    fans = []
    while after:
        loop = [next(iter(after))]
        while loop[-1] in after:
            loop.append(after.pop(loop[-1]))
        fans += [(loop[0], *pair) for pair in itertools.pairwise(loop[1:-1])]
    return np.concatenate([faces, np.array(fans, faces.dtype).reshape(-1, 3)])
