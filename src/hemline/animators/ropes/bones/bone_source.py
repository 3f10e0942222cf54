"""Source of the bones while a garment plays: ropes, learned bones, or a smooth change between them."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.rope_frame_kernels import carry_nodes
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float, Nodes, Transforms
from hemline.bodies.body import PosedBody
from hemline.collide.primitives.body_primitives import Colliders
from hemline.learning.key_frame import to_key_frame
from hemline.learning.mlp import Mlp

from .body_input_kernels import write_body_inputs
from .body_inputs import BODY_INPUT_COUNT, CORRECTION_INPUTS, CORRECTION_VELOCITY, INPUT_JOINTS, BodyAtRest
from .bone_correction import BoneCorrection
from .bone_limit_kernels import limit_bones
from .bones import margins_of
from .chains import Ropes
from .learned_bones import BonesStep, LearnedBones, LearnedBonesState

GRAVITY = RopeConstants().gravity
"""The gravity that learned bones were trained with [m/s^2]."""
TAKEOVER_START, TAKEOVER_END = 0.1, 0.3
"""Distances from the range of the training at which ropes begin to take over, and at which they have taken over.

Both are fractions of that range, and apply to inputs and outputs of the learned bones (`BonesStep.beyond`)."""
ROPES_STRETCH, PAIRS_STRETCH = 1.1, 1.02
"""Largest distances of bones in simulated cloth. `ROPES_STRETCH` is relative to the length of a rope. `PAIRS_STRETCH`
is relative to the longest distance that the cloth between two chains allows."""
LIMIT_SWEEPS = 4
"""Number of sweeps over all pairs and ropes in which `limit_bones` brings bones together."""
SECONDS_TO_ROPES, SECONDS_TO_LEARNED = 0.5, 2.0
"""Shortest duration of a change to ropes, and of one back to learned bones [s]."""
SECONDS_TO_FOLLOW = 0.1
"""Time constant with which learned bones are drawn to the ropes while those take over [s]."""


@dataclass(frozen=True, eq=False)
class BonesState:
    """State of both sources. Ropes are not stepped while learned bones play alone; learned bones follow the ropes."""

    ropes: RopesState
    learned: LearnedBonesState | None
    """State of the learned bones; `None` for a model without them."""
    ropes_weight: Float[np.ndarray, ""]
    """Weight of the ropes: 0 while learned bones play alone, 1 after ropes have taken over."""

    def relocate(self, motion: RigidTransform) -> "BonesState":
        """Returns the state rotated and translated as a whole, history included."""
        learned = None if self.learned is None else self.learned.relocate(motion)
        return replace(self, ropes=self.ropes.relocate(motion), learned=learned)


@dataclass(frozen=True, eq=False)
class BoneSource:
    """Displacements of all bones from rest in the frame of the key joint, frame by frame.

    Learned bones know only the body's motion and gravity, within the range of their training. With wind, a user's force
    or another gravity, and where the body leaves that range, ropes take over.
    """

    ropes: Ropes
    correction: BoneCorrection | Mlp
    """Correction of the ropes' bones. Models of format 3 have a network, which sees the bones alone."""
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
        """Whether a force acts that learned bones were not trained with."""
        constants = self.ropes.constants
        return self.ropes.hook is not None or any(constants.wind) or constants.gravity != GRAVITY

    def start(self, posed: PosedBody) -> BonesState:
        """Returns the state at rest on a body."""
        ropes = self.ropes.start(posed)
        learned = self.learned and self.learned.start(ropes.positions[self._free], ropes.frames)
        return BonesState(ropes, learned, np.asarray(float(self.unknown_forces)))

    def step(
        self, state: BonesState, posed: PosedBody, dt: float, rest: Nodes
    ) -> tuple[BonesState, Float[np.ndarray, " ins"]]:
        """Advances to a posed body.

        Args:
            state: The state before; it is not changed.
            posed: The body now.
            dt: Time since the state: from 1 us to 10 s [s].
            rest: All bones in the rest drape on this body's shape [m].

        Returns:
            The state after, and the displacements, bone by bone, float32 [m].
        """
        if self.learned is None or state.learned is None:
            ropes = self.ropes.step(state.ropes, posed, dt)
            moved = self._correct(ropes, posed, rest, state.ropes.frames, dt)
            return BonesState(ropes, None, state.ropes_weight), self._limit_displacements(moved, rest)
        old, learned, frames = state.ropes, state.learned, self.ropes.primitives.joint_frames(posed)
        body = BodyAtRest(self.ropes.key_index, old.pivots)
        if self.ropes.is_teleport(learned.bodies[2], frames, old.pivots, dt):
            learned = learned.follow_teleport(self.ropes.key_index, frames)
        primitives = self.ropes.primitives
        colliders = Colliders(primitives.kinds, primitives.joints, old.shapes, old.centres, old.pivots)
        made = self.learned.step(learned, body, rest[self._free], self._margins, colliders, frames, dt)
        positions = np.empty((self.ropes.node_count, 3))
        carried = np.empty_like(old.kinematic_rest)
        carry_nodes(self.ropes.carriage.weights, old.kinematic_rest, frames, carried)
        positions[self.ropes.kinematic] = carried
        positions[self._free] = made.positions
        made = self._limit_step(made, positions)
        weight = self._next_ropes_weight(float(state.ropes_weight), made.beyond, dt)
        if float(state.ropes_weight) > 0:
            ropes = self.ropes.step(old, posed, dt)
        elif weight > 0:
            ropes = self._start_ropes(made, posed, learned, dt)
        else:
            ropes = old
        moved = self._displacements(positions, posed, rest)
        if weight > 0:
            blend = np.float32(weight * weight * (3 - 2 * weight))
            corrected = self._correct(ropes, posed, rest, learned.bodies[2], dt)
            moved = self._limit_displacements((1 - blend) * moved + blend * corrected, rest)
        learned = self._follow_ropes(made, ropes, weight, dt) if weight > 0 else made.state
        return BonesState(ropes, learned, np.asarray(weight)), moved

    def _limit_step(self, made: BonesStep, positions: Nodes) -> BonesStep:
        """Returns the step with bones no farther apart than the cloth allows; changes `positions`, of all bones."""
        if self._limit(positions) == 0:
            return made
        free, state = positions[self._free], made.state
        if float(state.elapsed) == 0:
            state = replace(state, positions=np.stack([state.positions[0], free]))
        return replace(made, state=state, positions=free)

    def _limit_displacements(self, moved: Float[np.ndarray, " ins"], rest: Nodes) -> Float[np.ndarray, " ins"]:
        """Returns displacements with bones no farther apart than the cloth allows.

        Ropes hang side by side and know nothing of each other, so they may drift apart when the body runs.
        """
        positions = rest + moved.reshape(-1, 3).astype(np.float64)
        return moved if self._limit(positions) == 0 else (positions - rest).astype(np.float32).reshape(-1)

    def _limit(self, positions: Nodes) -> float:
        """Brings bones together by `limit_bones`, in place; returns the largest excess found before that."""
        chains = self.ropes.chains
        spans = chains.pair_spans[:, 1]
        return limit_bones(
            chains.parents, chains.lengths, chains.pairs, spans, ROPES_STRETCH, PAIRS_STRETCH, LIMIT_SWEEPS, positions
        )

    def _next_ropes_weight(self, now: float, beyond: float, dt: float) -> float:
        wanted = (
            1.0
            if self.unknown_forces
            else float(np.clip((beyond - TAKEOVER_START) / (TAKEOVER_END - TAKEOVER_START), 0, 1))
        )
        return now + float(np.clip(wanted - now, -dt / SECONDS_TO_LEARNED, dt / SECONDS_TO_ROPES))

    def _start_ropes(self, made: BonesStep, posed: PosedBody, before: LearnedBonesState, dt: float) -> RopesState:
        """Starts ropes where the learned bones are, with the velocities of the learned bones."""
        state, kinematic = self.ropes.start(posed), self.ropes.kinematic
        positions, velocities = state.positions.copy(), np.zeros_like(state.positions)
        positions[self._free], velocities[self._free] = made.positions, made.velocities
        last = self.ropes.carriage.positions_in(before.bodies[2], state.kinematic_rest)
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

    def _follow_ropes(self, made: BonesStep, ropes: RopesState, weight: float, dt: float) -> LearnedBonesState:
        """Draws the learned bones to the ropes: the larger the weight of the ropes, the faster, and all the way at 1.

        Left alone, the learned bones would drift off outside the range of their training, and the change back would
        show a blend of two very different shapes.
        """
        assert self.learned is not None
        now, speed = ropes.positions[self._free], ropes.velocities[self._free]
        back = float(made.state.elapsed)
        steps = np.stack([now - speed * (back + self.learned.seconds), now - speed * back])
        drawn = 1.0 if weight == 1 else 1 - math.exp(-weight * dt / SECONDS_TO_FOLLOW)
        return replace(made.state, positions=(1 - drawn) * made.state.positions + drawn * steps)

    def _displacements(self, positions: Nodes, posed: PosedBody, rest: Nodes) -> Float[np.ndarray, " ins"]:
        key = posed.transforms[self.ropes.key_index]
        return (to_key_frame(key, positions) - rest).astype(np.float32).reshape(-1)

    def _correct(
        self, ropes: RopesState, posed: PosedBody, rest: Nodes, before: Transforms, dt: float
    ) -> Float[np.ndarray, " ins"]:
        """Returns the corrected displacements of the ropes' bones; `before` are the skin transforms a step ago."""
        moved = self._displacements(ropes.positions, posed, rest)
        if isinstance(self.correction, Mlp):
            return moved + self.correction(moved)
        return moved + self.correction(moved, self._body_inputs(ropes, before, dt))

    def _body_inputs(self, ropes: RopesState, before: Transforms, dt: float) -> Float[np.ndarray, " body"]:
        """Returns `body_inputs.correction_inputs`, computed by a kernel; a teleport counts as standing still."""
        now, key = ropes.frames, self.ropes.key_index
        then = now if self.ropes.is_teleport(before, now, ropes.pivots, dt) else before
        inputs = np.empty(BODY_INPUT_COUNT)
        write_body_inputs(ropes.pivots, key, INPUT_JOINTS, np.stack([then, then]), now, dt, dt, inputs)
        seen = inputs[CORRECTION_INPUTS]
        seen[CORRECTION_VELOCITY] -= np.asarray(self.ropes.constants.wind) @ now[key, :, :3]
        return seen
