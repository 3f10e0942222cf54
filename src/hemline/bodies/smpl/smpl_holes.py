"""Close the holes of a body's mesh, such as the eye sockets of SMPL-X: inside must mean something."""

import itertools

import numpy as np

from hemline.arrays import Faces, Int


def without_holes(faces: Faces) -> Int[np.ndarray, "all_faces 3"]:
    """The triangles, and after them a fan over each hole; no vertex is added.

    Holes are closed where each vertex of their rims lies on one rim once. Otherwise the triangles are returned as they
    are, and what needs a closed mesh refuses them.
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
