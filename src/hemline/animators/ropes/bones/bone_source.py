"""The bones while a garment plays: ropes, corrected towards the simulation, no farther apart than cloth allows."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float, Nodes, Transforms
from hemline.bodies.body import PosedBody
from hemline.learning.key_frame import to_key_frame

from .body_input_kernels import write_body_inputs
from .body_inputs import BODY_INPUT_COUNT, INPUT_JOINTS
from .bone_correction import BoneCorrection
from .bone_limit_kernels import limit_bones
from .chains import Ropes

ROPES_STRETCH, PAIRS_STRETCH = 1.1, 1.02
"""Largest distances of bones in simulated cloth. `ROPES_STRETCH` is relative to the length of a rope. `PAIRS_STRETCH`
is relative to the longest distance that the cloth between two chains allows."""
LIMIT_SWEEPS = 4
"""Number of sweeps over all pairs and ropes in which `limit_bones` brings bones together."""


@dataclass(frozen=True, eq=False)
class BoneSource:
    """Displacements of all bones from rest in the frame of the key joint, frame by frame."""

    ropes: Ropes
    correction: BoneCorrection

    def start(self, posed: PosedBody) -> RopesState:
        """Returns the state at rest on a body."""
        return self.ropes.start(posed)

    def step(
        self, state: RopesState, posed: PosedBody, dt: float, rest: Nodes
    ) -> tuple[RopesState, Float[np.ndarray, " ins"]]:
        """Advances to a posed body.

        Args:
            state: The state before; it is not changed.
            posed: The body now.
            dt: Time since the state: from 1 us to 10 s [s].
            rest: All bones in the rest drape on this body's shape [m].

        Returns:
            The state after, and the displacements, bone by bone, float32 [m].
        """
        after = self.ropes.step(state, posed, dt)
        key = posed.transforms[self.ropes.key_index]
        moved = (to_key_frame(key, after.positions) - rest).astype(np.float32).reshape(-1)
        moved = moved + self.correction(moved, self._body_inputs(after, state.frames, dt))
        return after, self._limit(moved, rest)

    def _body_inputs(self, after: RopesState, before: Transforms, dt: float) -> Float[np.ndarray, " body"]:
        """Returns `body_inputs.body_inputs`, computed by a kernel; a teleport counts as standing still."""
        now, pivots = after.frames, after.pivots
        then = now if self.ropes.is_teleport(before, now, pivots, dt) else before
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
