"""Principal components of the outputs of a linear map, and projections of large frames, strip by strip."""

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadDataset

ROWS_PER_STRIP = 4096
"""Rows (vertex coordinates) handled at a time."""

Strips = Callable[[slice], Float[np.ndarray, "frames strip"]]
"""A function that returns the displacements of all frames at some rows, float32."""


@dataclass(frozen=True)
class Pca:
    """Orthonormal basis vectors, largest first."""

    basis: Float[np.ndarray, "modes rows"]
    """One basis vector a row, float32."""
    deviations: Float[np.ndarray, " modes"]
    """Root mean square of each coefficient [m]."""
    explained: float
    """Fraction of the mean square displacement that the basis spans."""

    def coefficients(self, strips: Strips) -> Float[np.ndarray, "frames modes"]:
        r"""Returns $c = B u$ of each frame [m], float32."""
        parts = (strips(at) @ self.basis[:, at].T for at in _strips(self.basis.shape[1]))
        return functools.reduce(np.add, parts)


def principal_of_map(
    matrix: Float[np.ndarray, "rows ins"],
    offset: Float[np.ndarray, " rows"],
    inputs: Float[np.ndarray, "frames ins"],
    count: int,
) -> Pca:
    r"""Returns the first principal directions, about zero, of the outputs of a linear map $A x + a$ for given inputs.

    With $[A\ a] = Y$ and $S$ the second moments of $(x, 1)$ these are the left singular vectors of $Y S^{1/2}$: the
    work grows with the inputs, not with the frames. The identity gives the directions of the inputs.

    Args:
        matrix: $A$.
        offset: $a$.
        inputs: $x$.
        count: Number of directions; fewer are returned if the map has a lower rank.

    Returns:
        The basis; the sign of a vector is such that its largest entry is positive.

    Raises:
        BadDataset: All outputs are zero.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 ("a standard PCA model"). Differs: the mean is not removed first, so that
        coefficients of zero are the rest drape, which costs one direction. The outputs of a map are analysed, not the
        frames.
    """
    whole = np.column_stack([matrix, offset]).astype(np.float64)
    ones = np.column_stack([inputs, np.ones(len(inputs))]).astype(np.float64)
    values, vectors = np.linalg.eigh(ones.T @ ones / len(ones))
    root = vectors * np.sqrt(np.maximum(values, 0))
    spread = whole @ root
    squares, turns = _leading(spread.T @ spread, count)
    if not len(squares):
        raise BadDataset("principal components need frames that move", "a map to zero", "add takes to the dataset")
    basis = ((spread @ turns) / np.sqrt(squares)).T.astype(np.float32)
    basis *= np.sign(basis[np.arange(len(basis)), np.abs(basis).argmax(axis=1)])[:, None]
    basis /= np.linalg.norm(basis.astype(np.float64), axis=1)[:, None].astype(np.float32)
    explained = float(squares.sum() / (spread**2).sum())
    return Pca(np.ascontiguousarray(basis), np.sqrt(squares).astype(np.float32), explained)


def principal_of_rows(
    rows: Float[np.ndarray, "rows entries"], count: int
) -> tuple[Float[np.ndarray, "modes entries"], Float[np.ndarray, "rows modes"]]:
    """Returns the first principal directions of few long rows, about zero, and their coefficients.

    It uses the products of the rows with each other, which is many times faster than a singular value decomposition.
    Directions with less than a billionth of the largest variance are dropped.

    Args:
        rows: Few rows of many entries.
        count: Number of directions, at most.
    """
    values, vectors = _leading(rows @ rows.T, count)
    large = values > 1e-9 * values[:1].max(initial=1e-30)
    sizes = np.sqrt(values[large])
    coefficients = vectors[:, large] * sizes
    return coefficients.T @ rows / (sizes**2)[:, None], coefficients


def deviations_of(coefficients: Float[np.ndarray, "rows modes"]) -> Float[np.ndarray, " modes"]:
    """Returns the root mean square of each coefficient over the rows."""
    return np.sqrt((coefficients**2).mean(axis=0))


def _strips(rows: int) -> Iterator[slice]:
    for first in range(0, rows, ROWS_PER_STRIP):
        yield slice(first, min(first + ROWS_PER_STRIP, rows))


def _leading(gram: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    from scipy.linalg import eigh

    size = len(gram)
    values, vectors = eigh(gram, subset_by_index=(max(0, size - count), size - 1))
    values, vectors = values[::-1], vectors[:, ::-1]
    solid = values > max(values[0], 0.0) * 1e-12
    return values[solid], vectors[:, solid]
