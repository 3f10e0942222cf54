"""The bones of rope chains as a net of masses and springs, a coarse cloth in place of the ropes."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.mechanics.rope_force_kernels import add_air, add_balance
from hemline.arrays import Float, Int, Nodes, Transforms
from hemline.bodies.body import PosedBody
from hemline.learning.key_frame import to_key_frame

from .push_kernels import push_points_out

ITERATIONS, CONVERGED = 8, 1e-5
"""Largest number of Newton steps in a time step, and the change of positions at which they stop [m]."""


@dataclass(frozen=True, eq=False)
class Springs:
    """Springs between nodes, all with the same stiffness."""

    ends: Int[np.ndarray, "springs 2"]
    lengths: Float[np.ndarray, " springs"]
    """Lengths at rest [m]."""
    stiffness: float
    """[N/m]"""

    def step(
        self, start: Nodes, aim: Nodes, masses: Float[np.ndarray, " nodes"], free: Int[np.ndarray, " free"], dt: float
    ) -> Nodes:
        r"""Returns positions after a step of implicit Euler, which is stable for any stiffness.

        $$\min_x \sum_i \tfrac{m_i}{2 h^2} |x_i - y_i|^2 + \sum_s \tfrac{k}{2} (|x_a - x_b| - l_s)^2$$

        by Newton's method on the Hessian without the part by which compressed springs buckle.

        Args:
            start: First guess [m].
            aim: $y$: positions without springs; nodes that are not free stay there [m].
            masses: Mass of each node [kg].
            free: Nodes that move.
            dt: $h$ [s].

        Source: Baraff, Witkin, "Large Steps in Cloth Simulation", 1998; Choi, Ko, "Stable but Responsive Cloth", 2002,
            section 4.2 (compressed springs).
        """
        from scipy.sparse import diags
        from scipy.sparse.linalg import spsolve

        a, b = self.ends.T
        place = np.full(len(aim), -1)
        place[free] = np.arange(len(free))
        x = aim.copy()
        x[free] = start[free]
        inertia = np.repeat(masses[free] / dt**2, 3)
        for _ in range(ITERATIONS):
            offset = x[b] - x[a]
            span = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
            unit = offset / span[:, None]
            pull = self.stiffness * (span - self.lengths)
            force = np.zeros_like(x)
            np.add.at(force, a, pull[:, None] * unit)
            np.add.at(force, b, -pull[:, None] * unit)
            outer = np.einsum("sa,sb->sab", unit, unit)
            across = np.maximum(1 - self.lengths / span, 0)[:, None, None]
            blocks = self.stiffness * (outer + across * (np.eye(3) - outer))
            matrix = _assemble(blocks, place[a], place[b], len(free)) + diags(inertia)
            slope = inertia * (x[free] - aim[free]).reshape(-1) - force[free].reshape(-1)
            change = np.asarray(spsolve(matrix.tocsc(), -slope)).reshape(-1, 3)
            x[free] += change
            if np.abs(change).max() < CONVERGED:
                break
        return x


def _assemble(blocks: np.ndarray, a: np.ndarray, b: np.ndarray, count: int):
    """Returns the sparse matrix of springs between places `a` and `b`, -1 for fixed nodes."""
    from scipy.sparse import coo_matrix

    rows, columns, values = [], [], []
    for one, two, sign in ((a, a, 1), (b, b, 1), (a, b, -1), (b, a, -1)):
        both = np.flatnonzero((one >= 0) & (two >= 0))
        at = np.arange(3)
        rows.append(np.repeat(3 * one[both, None] + at, 3, axis=1))
        columns.append(np.tile(3 * two[both, None] + at, (1, 3)))
        values.append(sign * blocks[both].reshape(-1, 9))
    where = np.concatenate(rows).ravel(), np.concatenate(columns).ravel()
    return coo_matrix((np.concatenate(values).ravel(), where), shape=(3 * count, 3 * count))


@dataclass(frozen=True, eq=False)
class NetState:
    """State of a net."""

    positions: Nodes
    velocities: Nodes
    kinematic_rest: Nodes
    shapes: np.ndarray
    centres: np.ndarray


@dataclass(frozen=True, eq=False)
class MassSpringNet:
    """The nodes of rope chains, joined by springs along the ropes, across them and along one diagonal of each cell.

    It is a source of bones, see `baseline.BoneMotion`. Masses, gravity, air and the balance of the drape are those of
    the ropes; the balance has the load at rest, since a net has no tensions of ropes. Nodes leave the body's primitives
    along the shortest path.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 3 and Fig. 3.
    """

    ropes: Ropes
    springs: Springs

    @classmethod
    def of(cls, ropes: Ropes, stiffness: float) -> Self:
        """Makes the net of a garment's ropes, with springs as long as in the rest drape.

        Args:
            ropes: The ropes.
            stiffness: Stiffness of each spring [N/m].
        """
        parents, pairs = ropes.parents, ropes.chains.pairs
        inner = np.flatnonzero(parents >= 0)
        beside = np.stack([pairs[:, 0], parents[pairs[:, 1]]], axis=1)
        ends = np.concatenate([np.stack([parents[inner], inner], axis=1), pairs, beside])
        return cls(
            ropes, Springs(ends, np.linalg.norm(ropes.rest[ends[:, 0]] - ropes.rest[ends[:, 1]], axis=1), stiffness)
        )

    def start(self, posed: PosedBody) -> NetState:
        """Returns the state at rest on a body."""
        begun = self.ropes.start(posed)
        still = np.zeros_like(begun.positions)
        return NetState(begun.positions, still, begun.kinematic_rest, begun.shapes, begun.centres)

    def step(
        self, state: NetState, posed: PosedBody, dt: float, rest: Nodes
    ) -> tuple[NetState, Float[np.ndarray, " ins"]]:
        """Advances to a posed body, see `baseline.BoneMotion.step`."""
        ropes, constants = self.ropes, self.ropes.constants
        frames, free = ropes.primitives.joint_frames(posed), np.flatnonzero(ropes.parents >= 0)
        velocities = state.velocities * np.exp(-constants.drag * dt) + dt * self._accelerations(state, frames, dt)
        aim = state.positions + dt * velocities
        aim[ropes.kinematic] = ropes.carriage.positions_in(frames, state.kinematic_rest)
        found = self.springs.step(state.positions, aim, ropes.masses, free, dt)
        outside = found[free]
        margins = np.minimum(constants.margin, ropes.chains.clearances[free])
        push_points_out(
            ropes.primitives.kinds, ropes.primitives.joints, state.shapes, state.centres, frames, margins, outside
        )
        found[free] = outside
        after = NetState(found, (found - state.positions) / dt, state.kinematic_rest, state.shapes, state.centres)
        moved = to_key_frame(posed.transforms[ropes.key_index], found) - rest
        return after, moved.astype(np.float32).reshape(-1)

    def _accelerations(self, state: NetState, frames: Transforms, dt: float) -> Nodes:
        """Returns gravity, the balance of the drape and the air, as ropes have them [m/s^2]."""
        chains, numbers = self.ropes.chains.kernel_chains, self.ropes.constants.step_settings().numbers
        rotations = np.ascontiguousarray(frames[self.ropes.chains.chain_joints, :, :3])
        accelerations = np.tile(np.asarray(self.ropes.constants.gravity, np.float64), (len(state.positions), 1))
        add_balance(chains, numbers, rotations, self.ropes.chains.rest_tensions, state.positions, accelerations)
        add_air(chains, numbers, dt, state.positions, state.velocities, accelerations)
        return accelerations
