"""Flat cut of a skirt: a sector of a ring, closed to a cone, in rows and columns."""

import numpy as np

from hemline.arrays import Faces, Float

from .sector import grid_faces


def row_distances(rows: int, *, band: float, length: float) -> Float[np.ndarray, " rows"]:
    """Returns the distance of each row from the rim: the first two rows are `band` apart, the others evenly spaced [m].

    Args:
        rows: Number of rows.
        band: Distance of the second row [m].
        length: Distance of the last row [m].
    """
    return np.concatenate([[0.0], np.linspace(band, length, rows - 1)])


def cone_faces(rows: int, columns: int) -> tuple[Faces, Faces]:
    """Returns triangles of a grid that closes from its last column to its first, and the same ones on the flat sector.

    Args:
        rows: Number of rows.
        columns: Number of columns.

    Returns:
        Triangles of vertices r * columns + c; and triangles of points r * (columns + 1) + c of `cone_pattern`, whose
        last column repeats the first.
    """
    unrolled = grid_faces(rows, columns + 1)
    row, column = np.divmod(unrolled, columns + 1)
    return (row * columns + column % columns).astype(np.int32), unrolled


def cone_pattern(
    distances: Float[np.ndarray, " rows"], columns: int, *, rim: float, opening: float
) -> Float[np.ndarray, "points 2"]:
    """Returns a sector of a ring: row r lies on the circle of radius rim / opening + distances[r].

    Args:
        distances: Distance of each row from the rim [m].
        columns: Number of columns of the cone; the sector has one more.
        rim: Length of the inner arc [m].
        opening: Angle of the sector [rad].

    Returns:
        Flat positions, row by row [m].
    """
    angle, radius = opening * np.linspace(-0.5, 0.5, columns + 1), rim / opening + distances
    return np.stack([np.outer(radius, np.sin(angle)), -np.outer(radius, np.cos(angle))], axis=-1).reshape(-1, 2)


def cone_chains(rows: int, columns: int, *, first: int, chains: int, nodes: int) -> tuple[tuple[int, ...], ...]:
    """Returns chains of vertices down columns, evenly around, from row `first` to the last one.

    Args:
        rows: Number of rows.
        columns: Number of columns.
        first: Row of the roots.
        chains: Number of chains.
        nodes: Number of vertices of each chain.
    """
    down = np.round(np.linspace(first, rows - 1, nodes)).astype(int)
    around = np.round(np.arange(chains) * columns / chains).astype(int)
    return tuple(tuple((down * columns + column).tolist()) for column in around)
