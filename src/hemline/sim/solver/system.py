"""One linear system: the Hessian in the solver's order, and the arrays for its solution."""

import numpy as np

from .block_kernels import blocks_of, vector_of
from .conjugate_kernels import Matrix, PairBlocks, Sums, Vectors, coarse_matrix, conjugate_gradients, factorise
from .layout import Layout, Pattern


class System:
    """Working arrays of the solver for one layout, which are filled and solved repeatedly.

    Attributes:
        pattern: The layout, as kernels take it.
        matrix: The Hessian, without pairs.
        vectors: The right-hand side, the solution and working vectors.
        band: Factor of the coarse level of the preconditioner.
    """

    def __init__(self, layout: Layout):
        slots, clusters = len(layout.vertex), len(layout.begin)
        self.pattern = Pattern.from_layout(layout)
        self.matrix = Matrix(*(blocks_of(count) for count in (len(layout.ring.columns), slots, slots)))
        self.vectors = Vectors(*(vector_of(slots) for _ in Vectors._fields))
        self.band = np.empty((3 * clusters, layout.width))
        self.sums = Sums(np.empty(clusters), np.empty(3 * clusters), np.empty(3 * clusters), vector_of(clusters))

    def coarsen(self) -> bool:
        """Builds the coarse level of the preconditioner from the matrix; False if not positive definite."""
        coarse_matrix(tuple(self.pattern), tuple(self.matrix), self.band)
        return bool(factorise(self.band))

    def solve(self, pairs: PairBlocks, *, tolerance: float, steps: int) -> int:
        """Solves the system by conjugate gradients; returns the number of steps.

        Args:
            pairs: Contributions of pairs, added to the matrix.
            tolerance: The iteration stops when the preconditioned residual has fallen to this fraction.
            steps: Maximum number of steps.
        """
        system = self.pattern, self.matrix, self.band, pairs
        return conjugate_gradients(*system, tolerance, steps, self.vectors, self.sums)
