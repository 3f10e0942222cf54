"""Rope chains as a mechanical system, without body or garment: paper sections 3 to 6.

One step of length h, for all chains: (1) half a kick of velocities by external forces and tensions, then impulses;
(2) positions, root to tip, turned exactly on the sphere of the taut rope; (3) collisions, root to tip; impulses;
(4) the other half kick, then impulses.

Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting Clothing",
2024, Sections 3 to 6.

Differs from the paper:

- Eq. 3 and 5 are written for accelerations, so they hold for unequal masses, too. Tensions and impulses are solved
  directly unless sweeps are set.
- The centripetal part (Eq. 1) follows a finite turn: 2/h |v| tan(|v| h / 2l) for |v|^2 / l, so that a step of any
  length keeps the speed of a turning rope. v is the velocity half a step later, which depends on the tensions, so they
  are solved for twice: from external forces alone a bent chain at rest would seem to turn, and would tremble.
- A rope that is taut but slackening is pulled only as far as it must be. A rope that lacks up to a hundredth of its
  length may pull, too, as much as takes the slack up within the step: contact shortens ropes by micrometres, which must
  not release a chain.
- A rope that pulled in step 1 stays on its sphere in step 2, and the impulses of step 4 do not let it slacken.
  Otherwise it would go slack by O(h^3) in every step, and lose its tension for one step.
- Eq. 10 to 13 are taken in the moving frame of the node above. As printed, they are not invariant to a constant
  velocity of the whole world.
- The root's acceleration is the change of its velocity within each half step. Its velocity at the end of a step is
  extrapolated from the last two steps.
- The settled drape is an equilibrium of the ropes: the sum of tension and weight at each node is cancelled by a balance
  (`balance.drape_balance`) that the chain's joint carries and that is proportional to the load of the node. It fades
  where a node moves off what supports it, within `RopeConstants.balance_reach`.
- Velocities are smoothed along the chains and across them, as by the cloth between them; momentum is conserved.
- Drag acts as 1 - exp(-k h / 2) and springs saturate at what h can follow, so no constant makes a step unstable.
- Collisions find where the node's path entered a collider, by Newton's method, and detect a path right through one.
  `slide` goes on along the surface from there, where `history` stops. A push-out that would stretch a rope by more than
  a fifth is replaced by a free place within the rope's length, found by turning about the node above. Such a place
  exists wherever the node above is itself outside by the margin of this node. Below a node that is carried deep inside
  the body there may be none; then the rope is stretched, since being outside comes first.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.arrays import Float, Int, Nodes
from hemline.collide.primitives.body_primitives import Colliders

from .balance import node_loads
from .constants import RopeConstants
from .kernel_inputs import BodyMotion, Chains, NodeArrays, StepSettings
from .rope_step_kernels import advance_chains

Values = Float[np.ndarray, " nodes"]

_LONGEST_FRAME = 1 / 24
_DEEPEST_REST = 0.05
"""A node that rests inside the collider may stay this deep [m]."""


@dataclass(frozen=True, eq=False)
class RopeChains:
    """Chains of nodes. The first node of each chain, and all nodes before the first chain, are moved from outside."""

    offsets: Int[np.ndarray, " chains_and_one"]
    """First node of each chain, and the number of nodes; int32."""
    lengths: Values
    """Longest distance of each node to the node above it [m]; not used for kinematic nodes."""
    masses: Values
    """Mass of each node [kg]; not used for kinematic nodes."""
    rest_spans: Values
    """Distance of each node to the node above it at rest [m]."""
    rest_directions: Nodes
    """Direction from the node above it at rest."""
    chain_joints: Int[np.ndarray, " chains"]
    """Frame that carries the rest directions of each chain; int32."""
    pairs: Int[np.ndarray, "pairs 2"]
    """Nodes of neighbouring chains joined by lateral springs; int32."""
    pair_spans: Float[np.ndarray, "pairs 2"]
    """Distance of each pair at rest, and the longest that the cloth allows [m]."""
    clearances: Values
    """Distance of each node to the collider at rest, the upper bound of its margin [m]."""
    balance: Nodes
    """Accelerations that hold each node in the drape at rest, in the body's rest pose, see `drape_balance` [m/s^2]."""
    rest_tensions: Values
    """Tension of the rope above each node in that drape [N]."""
    constants: RopeConstants

    @classmethod
    def free(cls, chains: list[Nodes], constants: RopeConstants, masses: list[Values] | None = None) -> "RopeChains":
        """Returns chains given by node positions at rest, taut there and without springs between them.

        Args:
            chains: Positions of each chain's nodes, root first [m].
            constants: Constants of the chains.
            masses: Mass of each node of each chain [kg]; 1 unless given.
        """
        counts = [len(chain) for chain in chains]
        offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
        spans, directions = spans_and_directions(np.concatenate(chains).astype(float), offsets)
        weights = np.ones(offsets[-1]) if masses is None else np.concatenate(masses).astype(float)
        roots, free = np.zeros(len(chains), np.int32), np.full(len(weights), np.inf)
        none = np.zeros((0, 2))
        pairs, still = none.astype(np.int32), np.zeros_like(directions)
        return cls(
            offsets,
            spans,
            weights,
            spans,
            directions,
            roots,
            pairs,
            none,
            free,
            still,
            np.zeros(len(weights)),
            constants,
        )

    @cached_property
    def kinematic(self) -> Int[np.ndarray, " kin"]:
        """Nodes that are moved from outside, int32."""
        return np.concatenate([np.arange(self.offsets[0]), self.offsets[:-1]]).astype(np.int32)

    @cached_property
    def parents(self) -> Int[np.ndarray, " nodes"]:
        """The node above each node, -1 for kinematic ones; int32."""
        parents = np.arange(-1, self.offsets[-1] - 1, dtype=np.int32)
        parents[self.kinematic] = -1
        return parents

    @cached_property
    def across(self) -> Int[np.ndarray, "nodes 2"]:
        """The nodes to both sides of each node; the node itself at the edge of the cloth; int32."""
        across = np.repeat(np.arange(int(self.offsets[-1]), dtype=np.int32)[:, None], 2, axis=1)
        across[self.pairs[::-1, 1], 0] = self.pairs[::-1, 0]
        across[self.pairs[::-1, 0], 1] = self.pairs[::-1, 1]
        return across

    @cached_property
    def inverse_masses(self) -> Values:
        """1 / mass, 0 for kinematic nodes [1/kg]."""
        inverse = np.where(self.parents < 0, 0.0, 1.0 / np.maximum(self.masses, 1e-12))
        return np.ascontiguousarray(inverse)

    @cached_property
    def gentle_substep(self) -> float:
        r"""Longest substep [s] times the square root of the pull [m/s^2] that keeps every chain accurate and stable.

        The fastest swing of a chain of m ropes of length l under a pull a has about $\omega^2 = 4 m a / l$, and
        central differencing needs $\omega h < 2$; we stay below 1.6.
        """
        limits = [
            np.min(self.lengths[first + 1 : last]) / (last - first - 1)
            for first, last in zip(self.offsets[:-1], self.offsets[1:], strict=True)
            if last - first > 1
        ]
        return 0.8 * math.sqrt(min(limits)) if limits else math.inf

    def substeps(self, dt: float, pull: float) -> int:
        """Returns the number of substeps of a step of `dt` [s] while the roots are accelerated by `pull` [m/s^2]."""
        limit = math.ceil(self.constants.substep_limit * max(1.0, dt / _LONGEST_FRAME))
        gentle = self.gentle_substep / math.sqrt(max(pull + math.hypot(*self.constants.gravity), 1e-6))
        return max(1, min(limit, math.ceil(dt / min(self.constants.substep, gentle) - 1e-9)))

    def advance(
        self,
        positions: Nodes,
        velocities: Nodes,
        tensions: Values,
        kinematic: Float[np.ndarray, "4 kin 3"],
        dt: float,
        *,
        colliders: Colliders,
        frames: tuple[np.ndarray, np.ndarray],
        push: Nodes | None = None,
        steps: int | None = None,
    ) -> tuple[Nodes, Nodes, Values, np.ndarray]:
        """Advances all chains by one step.

        Args:
            positions: Nodes at the beginning of the step [m].
            velocities: Velocities of the nodes [m/s].
            tensions: Tensions of the last step, the start of the sweeps [N].
            kinematic: Positions of the kinematic nodes at both ends of the step [m], then their velocities [m/s].
            dt: Length of the step [s].
            colliders: Primitives.
            frames: Transforms of the colliders' frames at both ends, float64 (joints, 3, 4).
            push: Further accelerations of the nodes [m/s^2].
            steps: Substeps; computed from `dt` and the roots' acceleration unless given.

        Returns:
            Positions, velocities and tensions at the end, and which nodes were pushed out of a collider.
        """
        if steps is None:
            change = (kinematic[3] - kinematic[2]).mean(0) / dt if kinematic.shape[1] else np.zeros(3)
            steps = self.substeps(dt, math.sqrt(change @ change))
        nodes = NodeArrays(positions.copy(), velocities.copy(), tensions.copy(), np.zeros(len(positions), np.bool_))
        advance_chains(
            self.kernel_chains,
            self._step_settings,
            colliders,
            BodyMotion(*frames, dt),
            kinematic,
            self._no_push if push is None else push,
            steps,
            nodes,
        )
        return nodes.positions, nodes.velocities, nodes.tensions, nodes.touched

    def excess(self, positions: Float[np.ndarray, "*frames nodes 3"]) -> Float[np.ndarray, "*frames nodes"]:
        """Returns the excess of each rope over its length, max(0, l / l_max - 1); 0 for kinematic nodes [1]."""
        free = np.flatnonzero(self.parents >= 0)
        spans = np.linalg.norm(positions[..., free, :] - positions[..., free - 1, :], axis=-1)
        result = np.zeros(positions.shape[:-1])
        result[..., free] = np.maximum(0.0, spans / self.lengths[free] - 1.0)
        return result

    @cached_property
    def rest_loads(self) -> Values:
        """Load of each node in the settled drape: its weight and the tension of the rope below [N]."""
        return node_loads(self.offsets, self.masses, self.rest_tensions)

    @cached_property
    def kernel_chains(self) -> Chains:
        """The chains as kernels take them."""
        return Chains(
            self.offsets,
            self.lengths,
            self.rest_spans,
            self.rest_directions,
            self.inverse_masses,
            self.margins,
            self.chain_joints,
            self.across,
            self.pairs,
            self.pair_spans,
            self.balance,
            self.rest_loads,
            self.kinematic,
        )

    @cached_property
    def _step_settings(self) -> StepSettings:
        return self.constants.step_settings()

    @cached_property
    def margins(self) -> Values:
        """Distance that each node keeps from the colliders [m]."""
        return np.clip(self.clearances, -_DEEPEST_REST, self.constants.margin)

    @cached_property
    def _no_push(self) -> Nodes:
        return np.zeros((int(self.offsets[-1]), 3))


def spans_and_directions(positions: Nodes, offsets: np.ndarray) -> tuple[Values, Nodes]:
    """Returns the distance and direction from the node above each node; 0 and down for roots."""
    spans, directions = np.zeros(len(positions)), np.tile([0.0, -1.0, 0.0], (len(positions), 1))
    inner = np.setdiff1d(np.arange(int(offsets[0]), len(positions)), offsets[:-1])
    step = positions[inner] - positions[inner - 1]
    spans[inner] = np.linalg.norm(step, axis=1)
    directions[inner] = step / np.maximum(spans[inner, None], 1e-12)
    return spans, directions
