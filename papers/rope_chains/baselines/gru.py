"""Recurrent networks in place of the ropes, one for each chain."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hemline.animators.ropes.bones.body_inputs import BodyAtRest
from hemline.animators.ropes.bones.chains import Ropes
from hemline.arrays import Float, Int, Joints, Nodes, Transforms
from hemline.bodies.body import PosedBody
from hemline.learning.key_frame import to_key_frame

from .motion_inputs import motion_inputs

WARM_UP = 15
"""Steps before the output of a network counts, since its hidden state begins at zero."""


def chain_slots(parents: Int[np.ndarray, " nodes"]) -> Int[np.ndarray, "chains longest"]:
    """Returns the free bones of each chain from root to tip, as indices of free bones, padded with -1."""
    root, chains = np.arange(len(parents)), {}
    for place, node in enumerate(np.flatnonzero(parents >= 0)):
        root[node] = root[parents[node]]
        chains.setdefault(int(root[node]), []).append(place)
    longest = max(map(len, chains.values()))
    return np.array([each + [-1] * (longest - len(each)) for each in chains.values()], np.int32)


@dataclass(frozen=True, eq=False)
class GruCells:
    r"""One gated recurrent unit for each chain; all have the same inputs $x$, and each has its own hidden state $h$.

    $$r, z = \sigma(W x + a + V h + b), \quad n = \tanh(W_n x + a_n + r (V_n h + b_n)), \quad h' = (1 - z) n + z h$$

    The displacements of the chain's bones are linear in $h'$. Rows of $W, V, a, b$ are in the order $r, z, n$. All
    float32.

    Source: Cho et al., "Learning Phrase Representations using RNN Encoder-Decoder for Statistical Machine Translation",
        2014, Eq. 5 to 8. Differs: $r$ is applied after $V_n$, as in torch.
    """

    mean: Float[np.ndarray, " ins"]
    """Mean of the inputs in the training, by which they are shifted."""
    spread: Float[np.ndarray, " ins"]
    """Standard deviation of the inputs in the training, by which they are scaled."""
    input_weights: Float[np.ndarray, "chains rows ins"]
    """$W$."""
    input_bias: Float[np.ndarray, "chains rows"]
    """$a$."""
    hidden_weights: Float[np.ndarray, "chains rows hidden"]
    """$V$."""
    hidden_bias: Float[np.ndarray, "chains rows"]
    """$b$."""
    output_weights: Float[np.ndarray, "chains outs hidden"]
    """Map from hidden state to displacements, three rows for each bone [m]."""
    output_bias: Float[np.ndarray, "chains outs"]
    """[m]"""
    slots: Int[np.ndarray, "chains longest"]
    """The free bone of each three outputs, -1 for none; see `chain_slots`."""

    @property
    def initial_state(self) -> Float[np.ndarray, "chains hidden"]:
        """Initial hidden state."""
        return np.zeros((len(self.hidden_weights), self.hidden_weights.shape[2]), np.float32)

    def step(
        self, hidden: Float[np.ndarray, "chains hidden"], body: Float[np.ndarray, " ins"]
    ) -> tuple[Float[np.ndarray, "chains hidden"], Float[np.ndarray, "free 3"]]:
        """Returns the hidden state after a step, and displacements of the free bones from rest in the key frame [m].

        Args:
            hidden: The hidden state before; not changed.
            body: The inputs, see `COLUMNS`.
        """
        x = (body.astype(np.float32) - self.mean) / self.spread
        seen = self.input_weights @ x + self.input_bias
        recalled = np.einsum("crh,ch->cr", self.hidden_weights, hidden) + self.hidden_bias
        (r, z, n), (r_old, z_old, n_old) = np.split(seen, 3, axis=1), np.split(recalled, 3, axis=1)
        r, z = _sigmoid(r + r_old), _sigmoid(z + z_old)
        n = np.tanh(n + r * n_old)
        hidden = (1 - z) * n + z * hidden
        shown = (np.einsum("coh,ch->co", self.output_weights, hidden) + self.output_bias).reshape(*self.slots.shape, 3)
        used = self.slots >= 0
        moved = np.empty((used.sum(), 3), np.float32)
        moved[self.slots[used]] = shown[used]
        return hidden, moved


def _sigmoid(value: np.ndarray) -> np.ndarray:
    return 0.5 + 0.5 * np.tanh(0.5 * value)


@dataclass(frozen=True, eq=False)
class GruState:
    """State of the recurrent networks."""

    hidden: Float[np.ndarray, "chains hidden"]
    bodies: Float[np.ndarray, "2 joints 3 4"]
    """Skin transforms of the body in the frame before the last, and in the last."""
    joints: Joints
    """The body's joints at rest [m]."""
    kinematic_rest: Nodes
    """Bones that the body carries, at rest [m]."""


@dataclass(frozen=True, eq=False)
class ChainGrus:
    """A gated recurrent unit for each rope chain; a source of bones, see `baseline.BoneMotion`.

    The input of a network is the body's motion; the cloth is only in its hidden state. Each frame is one step of the
    training, whatever its `dt`: at another frame rate the cloth swings faster or slower.

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Section 9, Fig. 13 and 14. Differs: the pose is that around the key joint; with `COLUMNS` of
        "motion" its velocities are inputs, too; outputs are displacements from rest in the key frame.
    """

    ropes: Ropes
    cells: GruCells
    seconds: float
    """Time of a step in the training [s]."""
    columns: Int[np.ndarray, " ins"]
    """Indices of the inputs among those of `motion_inputs`, see `COLUMNS`."""

    @cached_property
    def _free(self) -> np.ndarray:
        return np.flatnonzero(self.ropes.parents >= 0)

    def start(self, posed: PosedBody) -> GruState:
        """Returns the state on a body that has stood still for `WARM_UP` steps."""
        ropes = self.ropes.start(posed)
        bodies, hidden = np.stack([ropes.frames] * 2), self.cells.initial_state
        state = GruState(hidden, bodies, ropes.pivots, ropes.kinematic_rest)
        for _ in range(WARM_UP):
            hidden, _ = self.cells.step(hidden, self._inputs(state, ropes.frames))
        return GruState(hidden, bodies, ropes.pivots, ropes.kinematic_rest)

    def step(
        self, state: GruState, posed: PosedBody, dt: float, rest: Nodes
    ) -> tuple[GruState, Float[np.ndarray, " ins"]]:
        """Advances to a posed body.

        Args:
            state: The state before; not changed.
            posed: The body now.
            dt: Not used: a frame is a step.
            rest: All bones in the rest drape on this body's shape [m].

        Returns:
            The state after; displacements of all bones from rest in the key frame [m], float32, bone by bone.
        """
        frames = self.ropes.primitives.joint_frames(posed)
        hidden, free = self.cells.step(state.hidden, self._inputs(state, frames))
        moved, kinematic = np.empty((self.ropes.node_count, 3), np.float32), self.ropes.kinematic
        carried = self.ropes.carriage.positions_in(frames, state.kinematic_rest)
        moved[kinematic] = to_key_frame(posed.transforms[self.ropes.key_index], carried) - rest[kinematic]
        moved[self._free] = free
        after = GruState(hidden, np.stack([state.bodies[1], frames]), state.joints, state.kinematic_rest)
        return after, moved.reshape(-1)

    def _inputs(self, state: GruState, frames: Transforms) -> Float[np.ndarray, " ins"]:
        body = BodyAtRest(self.ropes.key_index, state.joints)
        before, then = state.bodies
        return motion_inputs(body, before, then, frames, self.seconds)[self.columns]
