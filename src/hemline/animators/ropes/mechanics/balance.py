"""The accelerations that ropes need to hang as the settled drape does: computed once, then carried by the body."""

from itertools import pairwise

import numpy as np

from hemline.arrays import Float, Int, Nodes

STANDARD_GRAVITY = 9.81
"""The gravity that a garment was settled under [m/s^2]."""

Values = Float[np.ndarray, " nodes"]


def drape_balance(
    offsets: Int[np.ndarray, " chains_and_one"], directions: Nodes, masses: Values, taut: np.ndarray
) -> tuple[Nodes, Values]:
    r"""Returns accelerations that make the drape an equilibrium of the ropes, and the tensions in it.

    From tip to root each rope takes up what the node weighs and what hangs from it, along its own direction $d_i$. The
    remainder is across the rope. The balance $b_i$ replaces whatever held the cloth there, the shoulder under it or the
    cloth beside it:

    $$T_i = \max(0, d_i \cdot l_i), \quad l_i = m_i g + T_{i+1} d_{i+1}, \quad m_i b_i = T_i d_i - l_i$$

    Where a chain hangs straight down the balance is zero.

    Args:
        offsets: First node of each chain, and the number of nodes.
        directions: Direction of each rope in the drape, from the node above.
        masses: Mass of each node [kg].
        taut: Which ropes are as long as they can be in the drape; the others do not pull.

    Returns:
        $b$ [m/s^2], zero for kinematic nodes, and $T$ [N].
    """
    balance, tensions = np.zeros_like(directions), np.zeros(len(masses))
    for first, last in pairwise(offsets.tolist()):
        below = np.zeros(3)
        for i in range(last - 1, first, -1):
            load = below - [0.0, masses[i] * STANDARD_GRAVITY, 0.0]
            tensions[i] = max(0.0, directions[i] @ load) if taut[i] else 0.0
            below = tensions[i] * directions[i]
            balance[i] = (below - load) / masses[i]
    return balance, tensions


def node_loads(offsets: Int[np.ndarray, " chains_and_one"], masses: Values, tensions: Values) -> Values:
    """Returns the weight of each node in the drape plus the tension of the rope below it [N]."""
    below = np.append(tensions[1:], 0.0)
    below[offsets[1:] - 1] = 0.0
    return np.maximum(masses * STANDARD_GRAVITY + below, 1e-12)
