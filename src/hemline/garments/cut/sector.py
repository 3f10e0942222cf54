"""Flat cut of a cape: a sector of a ring, in rows and columns."""

import numpy as np

from hemline.arrays import Faces, Float


def sector_pattern(
    rows: int, columns: int, *, rim: float, length: float, opening: float
) -> Float[np.ndarray, "verts 2"]:
    """Returns a sector of a ring: row r lies on the circle of radius rim / opening + r length / (rows - 1).

    Args:
        rows: Number of rows, from the rim to the hem.
        columns: Number of columns.
        rim: Length of the inner arc [m].
        length: From the inner to the outer arc [m].
        opening: Angle of the sector [rad].

    Returns:
        Flat positions, row by row [m].
    """
    angle = opening * np.linspace(-0.5, 0.5, columns)
    radius = rim / opening + length * np.linspace(0, 1, rows)
    return np.stack([np.outer(radius, np.sin(angle)), -np.outer(radius, np.cos(angle))], axis=-1).reshape(-1, 2)


def grid_faces(rows: int, columns: int) -> Faces:
    """Returns two triangles a cell, with diagonals that alternate like a chess board.

    Triangles are counter-clockwise where columns run to the left and rows downward.
    """
    index = np.arange(rows * columns, dtype=np.int32).reshape(rows, columns)
    a, b, c, d = (each.reshape(-1) for each in (index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]))
    white = (np.add.outer(np.arange(rows - 1), np.arange(columns - 1)) % 2 == 0).reshape(-1, 1)
    first = np.where(white, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(white, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.stack([first, second], axis=1).reshape(-1, 3)


def grid_size(vertex_count: int, aspect: float) -> tuple[int, int]:
    """Returns rows and columns whose product is nearest to a number of vertices, with a ratio of about `aspect`.

    Args:
        vertex_count: Number of vertices asked for.
        aspect: Columns divided by rows.

    Example:
        >>> grid_size(12690, 141 / 90), grid_size(4000, 141 / 90)
        ((90, 141), (50, 80))
    """
    middle = np.sqrt(vertex_count / aspect)
    rows = np.arange(max(2, int(0.94 * middle)), int(1.06 * middle) + 2)
    columns = np.maximum(2, np.round(vertex_count / rows)).astype(int)
    miss = np.abs(rows * columns - vertex_count) + np.abs(np.log(columns / rows / aspect))
    best = int(miss.argmin())
    return int(rows[best]), int(columns[best])
