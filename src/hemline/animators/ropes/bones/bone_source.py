"""The bones while a garment plays: ropes, corrected towards the simulation, no farther apart than cloth allows."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hemline.animators.rigid_transform import RigidTransform
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float, Int, Nodes, Transforms
from hemline.bodies.body import PosedBody
from hemline.learning.key_frame import to_key_frame

from .body_input_kernels import write_body_inputs
from .body_inputs import BODY_INPUT_COUNT, INPUT_JOINTS
from .bone_correction import BoneCorrection
from .bone_limit_kernels import limit_bones
from .chains import Ropes
from .tracker import TrackedPoints

ROPES_STRETCH, PAIRS_STRETCH = 1.1, 1.02
"""Largest distances of bones in simulated cloth. `ROPES_STRETCH` is relative to the length of a rope. `PAIRS_STRETCH`
is relative to the longest distance that the cloth between two chains allows."""
LIMIT_SWEEPS = 4
"""Number of sweeps over all pairs and ropes in which `limit_bones` brings bones together."""
SMOOTHING_SECONDS = 0.1
"""Time constant with which the correction is followed, since it repeats the tremor of the motion capture [s]."""
SWING_SECONDS = 0.7
"""Time constant of the mean from which swing is measured [s]."""


@dataclass(frozen=True, eq=False)
class BonesState:
    """State of the bones between frames."""

    ropes: RopesState
    change: Float[np.ndarray, " ins"]
    """Smoothed correction of the displacements, bone by bone in the frame of the key joint, float32 [m]."""
    tracked: TrackedPoints
    """The free bones as they are shown but for the gain of the swing and the limits of distances, float64."""
    mean: Float[np.ndarray, " ins"]
    """Mean over the last `SWING_SECONDS` of the displacements before that gain, float32 [m]."""

    def relocate(self, motion: RigidTransform) -> "BonesState":
        """Returns the state rotated and translated as a whole, history included."""
        return replace(self, ropes=self.ropes.relocate(motion), tracked=self.tracked.relocate(motion))


@dataclass(frozen=True, eq=False)
class BoneSource:
    """Displacements of all bones from rest in the frame of the key joint, frame by frame.

    The correction is followed with a time constant of `SMOOTHING_SECONDS`, and the corrected bones by `TrackedPoints`.
    What a linear correction predicts swings less than cloth does, as the mean of several outcomes does. So the swing,
    the deviation of the displacements from their mean over `SWING_SECONDS`, is multiplied by the correction's gain.
    """

    ropes: Ropes
    correction: BoneCorrection

    def start(self, posed: PosedBody) -> BonesState:
        """Returns the state at rest on a body."""
        ropes = self.ropes.start(posed)
        free = ropes.positions[self._free]
        change = np.zeros(3 * self.ropes.node_count, np.float32)
        return BonesState(ropes, change, TrackedPoints(free, np.zeros_like(free)), np.zeros_like(change))

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
        ropes, tracked = self.ropes.step(state.ropes, posed, dt), state.tracked
        before, now = state.ropes.frames, ropes.frames
        if self.ropes.is_moment(state.ropes, now, dt) or self.ropes.is_teleport(before, now, ropes.pivots, dt):
            key = self.ropes.key_index
            tracked = tracked.relocate(RigidTransform.between(before[key], now[key]))
            before = now
        key = posed.transforms[self.ropes.key_index].astype(np.float64)
        local = to_key_frame(key, ropes.positions)
        moved = (local - rest).astype(np.float32).reshape(-1)
        wanted = self.correction(moved, self._body_inputs(ropes, before, dt))
        change = state.change + np.float32(-math.expm1(-dt / SMOOTHING_SECONDS)) * (wanted - state.change)
        corrected = local[self._free] + change.reshape(-1, 3)[self._free]
        tracked = tracked.follow(corrected @ key[:, :3].T + key[:, 3], dt)
        local[self._free] = to_key_frame(key, tracked.positions)
        moved = (local - rest).astype(np.float32).reshape(-1)
        mean = state.mean + np.float32(-math.expm1(-dt / SWING_SECONDS)) * (moved - state.mean)
        swung = moved + self._gains * (moved - mean)
        return BonesState(ropes, change, tracked, mean), self._limit(swung, rest)

    @cached_property
    def _free(self) -> Int[np.ndarray, " free"]:
        return np.flatnonzero(self.ropes.parents >= 0)

    @cached_property
    def _gains(self) -> Float[np.ndarray, " ins"]:
        """Returns what is added of the swing of each coordinate: nothing where the body carries the bone."""
        free = np.repeat(self.ropes.parents >= 0, 3)
        return np.where(free, self.correction.swing_gain - 1, 0).astype(np.float32)

    def _body_inputs(self, after: RopesState, then: Transforms, dt: float) -> Float[np.ndarray, " body"]:
        """Returns `body_inputs.body_inputs`, computed by a kernel."""
        now, pivots = after.frames, after.pivots
        inputs, wind = np.empty(BODY_INPUT_COUNT), np.asarray(self.ropes.constants.wind, np.float64)
        write_body_inputs(pivots, self.ropes.key_index, INPUT_JOINTS, then, now, dt, wind, inputs)
        return inputs

    def _limit(self, moved: Float[np.ndarray, " ins"], rest: Nodes) -> Float[np.ndarray, " ins"]:
        """Returns displacements with bones no farther apart than the cloth allows.

        Ropes hang side by side and know nothing of each other, so they may drift apart when the body runs.
        """
        positions, chains = rest + moved.reshape(-1, 3).astype(np.float64), self.ropes.chains
        spans = chains.pair_spans[:, 1]
        excess = limit_bones(
            chains.parents, chains.lengths, chains.pairs, spans, ROPES_STRETCH, PAIRS_STRETCH, LIMIT_SWEEPS, positions
        )
        return moved if excess == 0 else (positions - rest).astype(np.float32).reshape(-1)
