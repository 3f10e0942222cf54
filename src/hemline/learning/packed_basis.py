"""PCA bases packed to 8 bits, from which one kernel computes vertices."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of

from .packed_basis_kernels import BLOCK_ROWS, vertices_from_coefficients

LARGEST_DIGIT = 127
"""Largest digit."""
MOST_COLUMNS = 512
"""Largest number of columns: 127 x 32767 x columns must stay below 2^31."""


@dataclass(frozen=True)
class PackedBasis:
    r"""Basis vectors as sums of scaled 8-bit columns.

    $B_{rk} \approx \sum_{j: m_j = k} s_j q_{rj}$: each mode has one column, and the modes that move the garment most
    have a second one that holds the rounding error of the first.
    """

    digits: Int[np.ndarray, "rows columns"]
    """Columns $q$, int8; a row is one coordinate of one vertex."""
    scales: Float[np.ndarray, " columns"]
    """Scale $s$ of each column."""
    modes: Int[np.ndarray, " columns"]
    """Mode $m$ that each column belongs to, int32."""

    @property
    def mode_count(self) -> int:
        """Number of coefficients."""
        return int(self.modes.max()) + 1

    @cached_property
    def blocks(self) -> Int[np.ndarray, "blocks pairs entries"]:
        """The digits in the order in which the kernel reads them: blocks of rows, then pairs of columns."""
        rows, columns = self.digits.shape
        blocks = -(-rows // BLOCK_ROWS)
        padded = np.zeros((blocks * BLOCK_ROWS, columns + columns % 2), np.int8)
        padded[:rows, :columns] = self.digits
        paired = padded.reshape(blocks, BLOCK_ROWS, -1, 2).transpose(0, 2, 1, 3)
        return np.ascontiguousarray(paired).reshape(blocks, -1, 2 * BLOCK_ROWS)

    @cached_property
    def _even(self) -> tuple[np.ndarray, np.ndarray]:
        odd = len(self.scales) % 2
        return np.pad(self.scales, (0, odd)), np.pad(self.modes, (0, odd))

    def vertices(
        self, coefficients: Float[np.ndarray, " modes"], rest: Vertices, transform: Float[np.ndarray, "3 4"]
    ) -> Vertices:
        r"""Returns $x = R (x_\mathrm{rest} + B c) + t$ of all vertices [m].

        Args:
            coefficients: PCA coefficients $c$ [m], float32.
            rest: Rest vertices [m], float32.
            transform: $[R | t]$, float32.
        """
        out = np.empty((len(rest), 3), np.float32)
        vertices_from_coefficients(self.blocks, *self._even, coefficients, rest, transform, out)
        return out

    def unpack(self) -> Float[np.ndarray, "modes rows"]:
        """Returns the rounded basis vectors, one a row, float32."""
        basis = np.zeros((self.mode_count, len(self.digits)), np.float32)
        for digit, scale, mode in zip(self.digits.T, self.scales, self.modes, strict=True):
            basis[mode] += scale * digit
        return basis

    def concatenate(self, other: "PackedBasis") -> "PackedBasis":
        """Returns both bases side by side; the coefficients of the other follow."""
        return PackedBasis(
            np.concatenate([self.digits, other.digits], axis=1),
            np.concatenate([self.scales, other.scales]),
            np.concatenate([self.modes, other.modes + np.int32(self.mode_count)]),
        )

    def at_vertices(self, kept: Int[np.ndarray, " kept"]) -> "PackedBasis":
        """Returns this basis restricted to some of the vertices."""
        rows = 3 * np.asarray(kept)[:, None] + np.arange(3)
        return PackedBasis(np.ascontiguousarray(self.digits[rows.reshape(-1)]), self.scales, self.modes)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file."""
        return {"digits": self.digits, "scales": self.scales, "modes": self.modes}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, vertex_count: int) -> Self:
        """Makes a basis from the arrays of a model file.

        Raises:
            BadModel: An array is missing or of another type or shape, or modes are not numbered without a gap.
        """
        digits = array_of(arrays, "digits", "int8", (3 * vertex_count, None))
        columns = digits.shape[1]
        scales = array_of(arrays, "scales", "float32", (columns,))
        modes = array_of(arrays, "modes", "int32", (columns,))
        if not 0 < columns <= MOST_COLUMNS:
            raise BadModel(f"a basis has 1 to {MOST_COLUMNS} columns", columns, AGAIN)
        found = np.unique(modes)
        if not np.array_equal(found, np.arange(len(found))):
            raise BadModel("the modes of a basis are numbered from 0 without a gap", modes.tolist()[:5], AGAIN)
        return cls(digits, scales, modes)


def pack_basis(
    basis: Float[np.ndarray, "modes rows"], deviations: Float[np.ndarray, " modes"], *, extra: int = 0
) -> PackedBasis:
    """Packs basis vectors to 8 bits.

    Args:
        basis: Basis vectors, one a row.
        deviations: Root mean square of the coefficient of each [m].
        extra: Number of second columns, for the modes whose rounding moves the garment most.

    Returns:
        The packed basis; columns are ordered by mode, second columns last.
    """
    scales = [_scale(vector) for vector in basis]
    order = sorted(range(len(basis)), key=lambda k: -deviations[k] * scales[k])[:extra]
    columns = [_digits(vector, scale) for vector, scale in zip(basis, scales, strict=True)]
    for k in order:
        left = basis[k] - scales[k] * columns[k].astype(np.float64)
        scales.append(_scale(left))
        columns.append(_digits(left, scales[-1]))
    modes = np.concatenate([np.arange(len(basis)), np.array(order, int)]).astype(np.int32)
    return PackedBasis(np.ascontiguousarray(np.stack(columns, axis=1)), np.array(scales, np.float32), modes)


def _scale(vector: np.ndarray) -> np.float32:
    return np.float32(max(np.abs(vector).max(initial=0.0), 1e-12) / LARGEST_DIGIT)


def _digits(vector: np.ndarray, scale: np.float32) -> np.ndarray:
    return np.clip(np.rint(vector / scale), -LARGEST_DIGIT, LARGEST_DIGIT).astype(np.int8)
