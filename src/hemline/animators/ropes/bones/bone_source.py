"""Where the bones come from when a garment plays: ropes, learned bones, or a smooth change between them."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hemline.animators.teleport import RigidTransform
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.rope_frame_kernels import carry_nodes
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float, Nodes
from hemline.bodies.body import PosedBody
from hemline.collide.primitives.proxy import Colliders
from hemline.learning.key_frame import to_key
from hemline.learning.mlp import Mlp

from .body_inputs import BodyAtRest
from .bone_limit_kernels import limit_bones
from .bones import margins_of
from .chains import Ropes
from .learned_bones import BonesStep, LearnedBones, LearnedBonesState

GRAVITY = RopeConstants().gravity
"""The one that learned bones know [m/s^2]."""
NEAR, FAR = 0.1, 0.3
"""Ropes begin to take over where the body is this far out of the range of the training, as a share of that range, and
have taken over there."""
ROPES_STRETCH, PAIRS_STRETCH = 1.1, 1.02
"""How far apart simulated bones come: along a rope over its length, across over the longest that the cloth allows."""
LIMIT_SWEEPS = 4
SECONDS_TO_ROPES = 0.5
SECONDS_TO_LEARNED = 2.0
"""How long a change takes at least [s]."""
SECONDS_TO_FOLLOW = 0.1
"""Time constant with which learned bones are drawn to ropes that have taken over [s]."""


@dataclass(frozen=True, eq=False)
class BonesState:
    """All that moves. While learned bones play alone the ropes rest; while ropes do, learned bones follow them."""

    ropes: RopesState
    learned: LearnedBonesState | None
    """None where a model has none."""
    share: Float[np.ndarray, ""]
    """How far ropes have taken over, 0 to 1."""

    def relocate(self, way: RigidTransform) -> "BonesState":
        """The same state turned and shifted as a whole, its past too."""
        learned = None if self.learned is None else self.learned.relocate(way)
        return replace(self, ropes=self.ropes.relocate(way), learned=learned)


@dataclass(frozen=True, eq=False)
class BoneSource:
    """Displacements of all bones from rest in the frame of the key joint, frame by frame.

    Learned bones know the body's motion and gravity alone, and what they were shown of those: with wind, a force of the
    user's or another gravity, and where the body leaves the range of the training, ropes take over.
    """

    ropes: Ropes
    correction: Mlp
    """Of the bones of ropes, see `correction.train_correction`."""
    learned: LearnedBones | None

    @cached_property
    def _free(self) -> np.ndarray:
        return np.flatnonzero(self.ropes.parents >= 0)

    @cached_property
    def _margins(self) -> np.ndarray:
        assert self.learned is not None
        return margins_of(self.ropes, self.learned.clearance)

    @property
    def unknown_forces(self) -> bool:
        """Whether something pulls that learned bones have not seen."""
        constants = self.ropes.constants
        return self.ropes.hook is not None or any(constants.wind) or constants.gravity != GRAVITY

    def start(self, posed: PosedBody) -> BonesState:
        """At rest on a body."""
        ropes = self.ropes.start(posed)
        learned = self.learned and self.learned.start(ropes.positions[self._free], ropes.frames)
        return BonesState(ropes, learned, np.asarray(float(self.unknown_forces)))

    def step(
        self, state: BonesState, posed: PosedBody, dt: float, rest: Nodes
    ) -> tuple[BonesState, Float[np.ndarray, " ins"]]:
        """Advance to a posed body.

        Args:
            state: The state before; it is not changed.
            posed: The body now.
            dt: Time since the state: from 1 us to 10 s [s].
            rest: All bones in the rest drape on this body's shape [m].

        Returns:
            The state after; displacements [m], float32, bone by bone.
        """
        if self.learned is None or state.learned is None:
            ropes = self.ropes.step(state.ropes, posed, dt)
            return BonesState(ropes, None, state.share), self._together(self._corrected(ropes, posed, rest), rest)
        old, shared, frames = state.ropes, state.learned, self.ropes.proxy.posed(posed)
        body = BodyAtRest(self.ropes.key_index, old.pivots)
        if self.ropes.is_teleport(shared.bodies[2], frames, old.pivots, dt):
            shared = shared.carried_along(self.ropes.key_index, frames)
        proxy = self.ropes.proxy
        colliders = Colliders(proxy.kinds, proxy.joints, old.shapes, old.centres, old.pivots)
        made = self.learned.step(shared, body, rest[self._free], self._margins, colliders, frames, dt)
        positions = np.empty((self.ropes.node_count, 3))
        carried = np.empty_like(old.kinematic_rest)
        carry_nodes(self.ropes.carriage.weights, old.kinematic_rest, frames, carried)
        positions[self.ropes.kinematic] = carried
        positions[self._free] = made.positions
        made = self._limited(made, positions)
        share = self._share(float(state.share), made.beyond, dt)
        if float(state.share) > 0:
            ropes = self.ropes.step(old, posed, dt)
        elif share > 0:
            ropes = self._taken_over(made, posed, shared, dt)
        else:
            ropes = old
        moved = self._displaced(positions, posed, rest)
        if share > 0:
            weight = np.float32(share * share * (3 - 2 * share))
            moved = self._together((1 - weight) * moved + weight * self._corrected(ropes, posed, rest), rest)
        learned = self._following(made, ropes, share, dt) if share > 0 else made.state
        return BonesState(ropes, learned, np.asarray(share)), moved

    def _limited(self, made: BonesStep, positions: Nodes) -> BonesStep:
        """What was made, with bones no farther apart than the cloth allows; `positions`, of all bones, is changed."""
        if self._limit(positions) == 0:
            return made
        free, state = positions[self._free], made.state
        if float(state.elapsed) == 0:
            state = replace(state, positions=np.stack([state.positions[0], free]))
        return replace(made, state=state, positions=free)

    def _together(self, moved: Float[np.ndarray, " ins"], rest: Nodes) -> Float[np.ndarray, " ins"]:
        """Displacements with bones no farther apart than the cloth allows: ropes, which hang side by side and know
        nothing of each other, may leave each other on a run.
        """
        positions = rest + moved.reshape(-1, 3).astype(np.float64)
        return moved if self._limit(positions) == 0 else (positions - rest).astype(np.float32).reshape(-1)

    def _limit(self, positions: Nodes) -> float:
        """Bring all bones together as far as `limit_bones` asks, in place; the largest excess before."""
        chains = self.ropes.chains
        spans = chains.pair_spans[:, 1]
        return limit_bones(
            chains.parents, chains.lengths, chains.pairs, spans, ROPES_STRETCH, PAIRS_STRETCH, LIMIT_SWEEPS, positions
        )

    def _share(self, now: float, beyond: float, dt: float) -> float:
        wanted = 1.0 if self.unknown_forces else float(np.clip((beyond - NEAR) / (FAR - NEAR), 0, 1))
        return now + float(np.clip(wanted - now, -dt / SECONDS_TO_LEARNED, dt / SECONDS_TO_ROPES))

    def _taken_over(self, made: BonesStep, posed: PosedBody, before: LearnedBonesState, dt: float) -> RopesState:
        """Ropes where the learned bones are, as fast as those."""
        state, kinematic = self.ropes.start(posed), self.ropes.kinematic
        positions, velocities = state.positions.copy(), np.zeros_like(state.positions)
        positions[self._free], velocities[self._free] = made.positions, made.velocities
        last = self.ropes.carriage.carried(before.bodies[2], state.kinematic_rest)
        rates = (positions[kinematic] - last) / dt
        velocities[kinematic] = rates
        return replace(
            state,
            positions=positions,
            velocities=velocities,
            kinematic_velocities=rates,
            kinematic_rates=rates.copy(),
            last_dt=np.asarray(float(dt)),
        )

    def _following(self, made: BonesStep, ropes: RopesState, share: float, dt: float) -> LearnedBonesState:
        """Learned bones drawn to where the ropes are, the faster the farther those have taken over: wholly at last.

        Left alone, they would go astray where they know least, and the change would show a mean of two garments.
        """
        assert self.learned is not None
        now, speed = ropes.positions[self._free], ropes.velocities[self._free]
        back = float(made.state.elapsed)
        steps = np.stack([now - speed * (back + self.learned.seconds), now - speed * back])
        drawn = 1.0 if share == 1 else 1 - math.exp(-share * dt / SECONDS_TO_FOLLOW)
        return replace(made.state, positions=(1 - drawn) * made.state.positions + drawn * steps)

    def _displaced(self, positions: Nodes, posed: PosedBody, rest: Nodes) -> Float[np.ndarray, " ins"]:
        key = posed.transforms[self.ropes.key_index]
        return (to_key(key, positions) - rest).astype(np.float32).reshape(-1)

    def _corrected(self, ropes: RopesState, posed: PosedBody, rest: Nodes) -> Float[np.ndarray, " ins"]:
        moved = self._displaced(ropes.positions, posed, rest)
        return moved + self.correction(moved)
