"""One linear system: the Hessian in the solver's order, and what solving it needs."""

import numpy as np

from .block_kernels import blocks_of, vector_of
from .conjugate_kernels import Matrix, PairBlocks, Sums, Vectors, coarse_matrix, conjugate_gradients, factorise
from .layout import Layout, Pattern


class System:
    """Working arrays of the solver for one layout; filled, solved and filled anew.

    Attributes:
        pattern: The layout, as kernels take it.
        matrix: The Hessian, without pairs.
        right: Right-hand side, a vector.
        vectors: The solution, and vectors to work with.
        band: The coarse level of the preconditioner, factorised.
    """

    def __init__(self, layout: Layout):
        slots, clusters = len(layout.vertex), len(layout.begin)
        self.pattern = Pattern.of(layout)
        self.matrix = Matrix(*(blocks_of(count) for count in (len(layout.ring.columns), slots, slots)))
        self.right = vector_of(slots)
        self.vectors = Vectors(*(vector_of(slots) for _ in range(4)))
        self.band = np.empty((3 * clusters, layout.width))
        self.sums = Sums(np.empty(clusters), np.empty(3 * clusters), np.empty(3 * clusters), vector_of(clusters))

    def coarsen(self) -> bool:
        """The coarse level of the preconditioner from the matrix as it is; False: it is not positive."""
        coarse_matrix(tuple(self.pattern), tuple(self.matrix), self.band)
        return bool(factorise(self.band))

    def solve(self, pairs: PairBlocks, *, share: float, steps: int) -> int:
        """Conjugate gradients; returns how many steps they took.

        Args:
            pairs: Added to the matrix.
            share: They stop when the preconditioned residual has fallen to this share.
            steps: At most.
        """
        what = tuple(self.pattern), tuple(self.matrix), self.band, tuple(pairs), self.right
        return conjugate_gradients(*what, share, steps, tuple(self.vectors), tuple(self.sums))
