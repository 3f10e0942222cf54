"""Energy of pair contact: the cloth with itself, with the body's vertices, with second places, and with capsules."""

import numpy as np
from jaxtyping import Float

from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.pairs.pair_kernels import (
    PAIR_CHUNK,
    pair_blocks,
    pair_diagonal,
    pair_forces,
    pairs_at_vertices,
)
from hemline.sim.contact.pairs.pairs import Pairs
from hemline.sim.solver.block_kernels import blocks_of, vector_of
from hemline.sim.solver.conjugate_kernels import PairBlocks
from hemline.sim.solver.layout import Layout

NO_PAIR_BLOCKS = PairBlocks(
    np.empty((0, 4), np.uint32),
    np.empty((0, 4), np.float32),
    np.empty(0, np.float32),
    np.empty(0, np.uint32),
    np.empty(0, np.uint32),
    np.empty(0, np.float32),
)
"""Blocks of a step without pairs."""


class ContactPairs:
    r"""The energy of all pairs: `SelfContact`, `BodyPoints`, second places (`ContactWithHistory`) and `Capsules`.

    $$E(x) = \sum_p \frac{k_p}{3 t_p} d_p^3 + \mu_p L_p\, f_0(|u_p|), \qquad d = \max(0,\; r_0 - n \cdot r),
      \quad r = \sum_c w_c x_c$$

    in J. The load $k d^2 / t$ grows with the square of the depth, up to a depth of $t$, and is constant beyond; $u$ is
    the slip across $n$. Kernels: `pair_kernels.pair_forces` and `pair_blocks`; formula: `load_kernels.press_terms`.

    Args:
        pairs: The pairs at their current positions.
        creep: Slip below which friction is smoothed [m].

    Source: Li et al., "Incremental potential contact", ACM TOG 39(4), 2020, Eq. 14, for friction. Differs: a penalty
        that keeps each pair on its side, not a barrier; its load is quadratic, so that Newton's steps do not alternate
        between touching and not touching.
    """

    def __init__(self, pairs: Pairs, creep: float):
        self.pairs, self.creep = pairs, creep
        self._force = np.empty((len(pairs), 3))
        self._energy = np.empty((len(pairs) + PAIR_CHUNK - 1) // PAIR_CHUNK)

    def evaluate(self, x: Positions, gradient: Positions) -> float:
        """Returns the energy [J] and adds its gradient [N]."""
        pairs = self.pairs
        if not len(pairs):
            return 0.0
        pair_forces(x, tuple(pairs.rows), self.creep, self._force, self._energy)
        pairs_at_vertices(pairs.rows.corners, pairs.rows.weights, tuple(pairs.at), self._force, gradient)
        return float(self._energy.sum())

    def blocks(self, x: Positions, layout: Layout, diagonal: Float[np.ndarray, "verts 6"]) -> PairBlocks:
        """Returns the Hessian for the solver, and writes its diagonal blocks to `diagonal`."""
        pairs = self.pairs
        if not len(pairs):
            diagonal[:] = 0
            return NO_PAIR_BLOCKS
        block, (corners, weights, *_) = blocks_of(len(pairs)), pairs.rows
        pair_blocks(x, tuple(pairs.rows), self.creep, block)
        pair_diagonal(corners, weights, tuple(pairs.at), block, diagonal)
        return PairBlocks(layout.slot[corners], weights.astype(np.float32), block, *pairs.at, vector_of(len(pairs)))
