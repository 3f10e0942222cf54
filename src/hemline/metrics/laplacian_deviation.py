"""Change of the mesh shape around the vertices that a correction moved."""

import numpy as np

from hemline.arrays import Faces, Float, Mask, Vertices

LEAST_SINE = 0.05
"""Lower bound of the sines of angles, so that a single collapsed triangle does not dominate the mean."""


def laplacian_deviation(before: Vertices, after: Vertices, faces: Faces, moved: Mask) -> float:
    r"""Returns the mean of $|\mathrm{diag}(L) - \mathrm{diag}(L^C)|$ over the vertices that were moved.

    $L_{ii} = \frac 1 2 \sum_j (\cot\alpha_{ij} + \cot\beta_{ij})$, half the cotangents of the two angles opposite to
    each edge at $i$; $L$ of the mesh before, $L^C$ after the correction. It has no unit; smaller is better.

    Args:
        before: The garment before [m].
        after: The garment after [m].
        faces: Triangles of the garment.
        moved: Whether each vertex was moved; the mean is over these.

    Returns:
        The mean; NaN if no vertex was moved.

    Source: Li et al., "SwinGar", 2023, Section V-B, Table III. Differs: angles of less than three degrees count as
        three.
    """
    if not moved.any():
        return float("nan")
    return float(np.abs(_diagonal(before, faces) - _diagonal(after, faces))[moved].mean())


def _diagonal(vertices: Vertices, faces: Faces) -> Float[np.ndarray, " verts"]:
    corners = np.asarray(vertices, np.float64)[faces]
    cotangents = np.empty((len(faces), 3))
    for corner in range(3):
        one = corners[:, (corner + 1) % 3] - corners[:, corner]
        two = corners[:, (corner + 2) % 3] - corners[:, corner]
        sine = np.linalg.norm(np.cross(one, two), axis=1)
        lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
        cotangents[:, corner] = (one * two).sum(axis=1) / np.maximum(sine, np.maximum(LEAST_SINE * lengths, 1e-30))
    both = cotangents.sum(axis=1, keepdims=True) - cotangents  # the angles opposite to the two edges at a corner
    return np.bincount(faces.reshape(-1), both.reshape(-1) / 2, len(vertices))
