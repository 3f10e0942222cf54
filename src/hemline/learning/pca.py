"""Principal components of what a linear map makes, and projections of large frames, strip by strip."""

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float
from hemline.errors import BadDataset

STRIP = 4096
"""Rows (vertex coordinates) handled at a time."""

Strips = Callable[[slice], Float[np.ndarray, "frames strip"]]
"""Gives the displacements of all frames at some rows, float32."""


@dataclass(frozen=True)
class Pca:
    """Orthonormal basis vectors, largest first."""

    basis: Float[np.ndarray, "modes rows"]
    """One basis vector a row, float32."""
    deviations: Float[np.ndarray, " modes"]
    """Root mean square of each coefficient [m]."""
    explained: float
    """Share of the mean square displacement that the basis holds."""

    def coefficients(self, strips: Strips) -> Float[np.ndarray, "frames modes"]:
        r"""$c = B u$ of each frame [m], float32."""
        parts = (strips(at) @ self.basis[:, at].T for at in _strips(self.basis.shape[1]))
        return functools.reduce(np.add, parts)


def principal_of_map(
    matrix: Float[np.ndarray, "rows ins"],
    offset: Float[np.ndarray, " rows"],
    inputs: Float[np.ndarray, "frames ins"],
    count: int,
) -> Pca:
    r"""The first principal directions of what a linear map $A x + a$ makes of given inputs, about zero.

    With $[A\ a] = Y$ and $S$ the second moments of $(x, 1)$ those are the left singular vectors of $Y S^{1/2}$: the
    work grows with the inputs, not with the frames. The identity gives those of the inputs themselves.

    Args:
        matrix: $A$.
        offset: $a$.
        inputs: $x$.
        count: Directions wanted; fewer come back where the map has a lower rank.

    Returns:
        The basis; the sign of a vector is such that its largest entry is positive.

    Raises:
        BadDataset: The map makes nothing but zeros.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 7 ("a standard PCA model"). Differs: the mean is not removed first, so that
        coefficients of zero are the rest drape; it costs one direction. Of what a map makes, not of the frames.
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
    """The first principal directions of few long rows, about zero, and their coefficients.

    By the products of the rows with each other: many times faster than a singular value decomposition of the rows.
    Directions that hold less than a billionth of the largest one's variance are left out.

    Args:
        rows: Few rows of many entries.
        count: How many directions, at most.
    """
    values, vectors = _leading(rows @ rows.T, count)
    kept = values > 1e-9 * values[:1].max(initial=1e-30)
    sizes = np.sqrt(values[kept])
    coefficients = vectors[:, kept] * sizes
    return coefficients.T @ rows / (sizes**2)[:, None], coefficients


def deviations_of(coefficients: Float[np.ndarray, "rows modes"]) -> Float[np.ndarray, " modes"]:
    """How large each coefficient is: its root mean square over the rows."""
    return np.sqrt((coefficients**2).mean(axis=0))


def _strips(rows: int) -> Iterator[slice]:
    for first in range(0, rows, STRIP):
        yield slice(first, min(first + STRIP, rows))


def _leading(gram: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    from scipy.linalg import eigh

    size = len(gram)
    values, vectors = eigh(gram, subset_by_index=(max(0, size - count), size - 1))
    values, vectors = values[::-1], vectors[:, ::-1]
    solid = values > max(values[0], 0.0) * 1e-12
    return values[solid], vectors[:, solid]
