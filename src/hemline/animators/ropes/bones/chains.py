"""The bones of a garment: rope chains that swing, and bones that the body carries."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.animators.ropes.mechanics.rope_frame_kernels import carry_nodes, kinematic_motion, squared_displacement
from hemline.animators.ropes.mechanics.state import RopesState
from hemline.arrays import Float, Int, Joints, Nodes, Transforms
from hemline.collide.primitives.body_primitives import BodyPrimitives, Colliders
from hemline.errors import BadInput
from hemline.motions import JOINT_NAMES

from .embedding import Carriage, NodeEmbedding

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

Hook = Callable[[Nodes, Nodes], Nodes]
"""A user's force. It is called once a step with positions in the world [m] and velocities [m/s], both (nodes, 3), and
returns accelerations (nodes, 3) [m/s^2]."""

CHAIN_ARRAYS = (
    "offsets",
    "lengths",
    "masses",
    "rest_spans",
    "rest_directions",
    "chain_joints",
    "pairs",
    "pair_spans",
    "clearances",
    "balance",
    "rest_tensions",
)
CARRIAGE_ARRAYS = ("rest", "weights", "nearest", "nearest_rest")
_TELEPORT_SPEED = 30.0
_MOMENT, _MOMENT_DISTANCE = 0.004, 0.001
"""Steps shorter than this may be moments, see `Ropes.is_moment` [s]; distance that is always allowed in them [m]."""
SHORTEST_STEP, LONGEST_STEP = 1e-6, 10.0
"""Shortest and longest duration of a step [s]. A longer one would take seconds that cannot be interrupted."""


@dataclass(frozen=True, eq=False)
class Ropes:
    """The bones of a garment: first kinematic ones that are on no chain, then chain by chain from root to tip.

    Kinematic bones are carried by the body.
    """

    chains: RopeChains
    """The mechanical system; the first node of each chain is kinematic, too."""
    embedding: NodeEmbedding
    """Each bone as a point of the garment's mesh."""
    carriage: Carriage
    """The kinematic bones as points that the body carries."""
    rest: Nodes
    """All bones in the body's rest pose, where the garment hangs settled, float64 [m]."""
    primitives: BodyPrimitives
    """The body's primitives, with which the chains collide, on the shape that the garment was made on."""
    betas: Float[np.ndarray, " betas"]
    """The body shape that the garment was made on."""
    key_joint: str
    """The joint whose frame carries the garment as a whole."""
    hook: Hook | None = None
    """A force of the user's own; not stored in files."""

    @property
    def node_count(self) -> int:
        """Number of bones."""
        return len(self.rest)

    @property
    def parents(self) -> Int[np.ndarray, " nodes"]:
        """The bone above each bone, -1 for kinematic ones."""
        return self.chains.parents

    @property
    def lengths(self) -> Float[np.ndarray, " nodes"]:
        """Longest distance of each bone to the one above it [m]."""
        return self.chains.lengths

    @property
    def masses(self) -> Float[np.ndarray, " nodes"]:
        """Mass of the cloth around each bone [kg]."""
        return self.chains.masses

    @property
    def constants(self) -> RopeConstants:
        """Constants of the chains."""
        return self.chains.constants

    @property
    def kinematic(self) -> Int[np.ndarray, " kin"]:
        """Bones that the body carries: those that are on no chain, then the chains' roots."""
        return self.chains.kinematic

    @cached_property
    def key_index(self) -> int:
        """Index of the key joint."""
        return JOINT_NAMES.index(self.key_joint)

    def with_constants(self, constants: RopeConstants) -> "Ropes":
        """Returns the ropes with other constants."""
        return replace(self, chains=replace(self.chains, constants=constants))

    def positions_on(self, vertices: Float[np.ndarray, "*frames verts 3"]) -> Float[np.ndarray, "*frames nodes 3"]:
        """Returns all bones on a garment's mesh, or on each mesh of a clip [m], float64."""
        return self.embedding.positions_on(vertices)

    def kinematic_positions(self, posed: "PosedBody") -> Float[np.ndarray, "kin 3"]:
        """Returns the kinematic bones on a posed body, of any shape [m], float64; its mesh is not needed."""
        return self.carriage.positions_in(posed.transforms, self.carriage.rest_on(posed.shaped))

    def kinematic_paths(
        self, transforms: Float[np.ndarray, "*frames joints 3 4"], shaped: "ShapedBody"
    ) -> Float[np.ndarray, "*frames kin 3"]:
        """Returns the kinematic bones of a whole clip, from its skin transforms [m], float64."""
        return self.carriage.positions_in(transforms, self.carriage.rest_on(shaped))

    def excess(self, state: RopesState) -> Float[np.ndarray, " nodes"]:
        """Returns the stretch of each rope beyond its length, as a ratio; 0 unless collisions stretched it [1]."""
        return self.chains.excess(state.positions)

    def start(self, posed: "PosedBody") -> RopesState:
        """Returns ropes that hang on a posed body as at rest; they move along with it from the first step on."""
        primitives = self._primitives_of(posed.shaped)
        frames = primitives.joint_frames(posed)
        rest = self.carriage.rest_on(posed.shaped)
        key = frames[self.key_index]
        shift = posed.shaped.joints[self.key_index] - self.primitives.pivots[self.key_index]
        positions = (self.rest + shift) @ key[:, :3].T + key[:, 3]
        positions[self.kinematic] = self.carriage.positions_in(frames, rest)
        still = np.zeros((len(rest), 3))
        return RopesState(
            positions,
            np.zeros_like(positions),
            self.chains.rest_tensions.copy(),
            np.zeros(len(positions), np.bool_),
            frames,
            still,
            still.copy(),
            np.zeros(()),
            rest,
            primitives.shapes,
            primitives.centres,
            primitives.pivots,
        )

    def step(self, state: RopesState, posed: "PosedBody", dt: float) -> RopesState:
        """Advances to a posed body.

        Args:
            state: The state before; it is not changed.
            posed: The body at the end of the step.
            dt: Length of the step, taken in substeps: from 1 us to 10 s [s]. A `Player` takes any time.

        Returns:
            The next state.

        Raises:
            BadInput: `dt` is out of range, the body's transforms are not finite, or the hook does not return finite
                accelerations of all nodes.
        """
        if not (math.isfinite(dt) and dt > 0):
            raise BadInput("a step needs a positive dt", dt, "give seconds, such as 1 / 60")
        if not SHORTEST_STEP <= dt <= LONGEST_STEP:
            cure = "take several steps, or play it with a Player, which takes any time"
            raise BadInput(f"a step of ropes takes from {SHORTEST_STEP:g} to {LONGEST_STEP:g} s", f"dt = {dt}", cure)
        dt, frames = float(dt), self.primitives.joint_frames(posed)
        if self.is_moment(state, frames, dt):
            return self._carry_along(state, frames)
        if self.is_teleport(state.frames, frames, state.pivots, dt):
            state = self._follow_teleport(state, frames)
        motion, velocities = self.kinematic_motion(state, frames, dt), state.velocities
        if float(state.last_dt) == 0.0:
            # no history: the garment moves along with its roots at first
            velocities = velocities + motion[2, self.chains.offsets[0] :].mean(0)
        push = (
            None
            if self.hook is None
            else _hook_accelerations(self.hook, state.positions + np.array(posed.origin), velocities)
        )
        colliders = Colliders(self.primitives.kinds, self.primitives.joints, state.shapes, state.centres, state.pivots)
        positions, velocities, tensions, touched = self.chains.advance(
            state.positions,
            velocities,
            state.tensions,
            motion,
            dt,
            colliders=colliders,
            frames=(state.frames, frames),
            push=push,
        )
        return RopesState(
            positions,
            velocities,
            tensions,
            touched,
            frames,
            motion[3],
            (motion[1] - motion[0]) / dt,
            np.asarray(dt),
            state.kinematic_rest,
            state.shapes,
            state.centres,
            state.pivots,
        )

    def kinematic_motion(self, state: RopesState, frames: Transforms, dt: float) -> Float[np.ndarray, "4 kin 3"]:
        """Returns positions of the kinematic bones at both ends of a step [m], then velocities at both ends [m/s].

        Args:
            state: The state before.
            frames: Skin transforms of the body at the end of the step, float64.
            dt: Length of the step [s].

        Raises:
            BadInput: The transforms are not finite.
        """
        motion = np.empty((4, len(self.kinematic), 3))
        carry_nodes(self.carriage.weights, state.kinematic_rest, frames, motion[1])
        if not math.isfinite(motion[1].sum()):
            raise BadInput("a body's transforms must be finite", "NaN or infinity", "check the pose")
        last = float(state.last_dt)
        kinematic_motion(
            self.kinematic, state.positions, state.kinematic_velocities, state.kinematic_rates, last, dt, motion
        )
        return motion

    def is_teleport(self, old: Transforms, new: Transforms, pivots: Joints, dt: float) -> bool:
        """Returns whether the key joint moved farther between two poses than a body can move: a teleport.

        Args:
            old: Skin transforms before.
            new: Skin transforms after.
            pivots: The body's joints at rest [m].
            dt: Time between them [s].
        """
        return math.sqrt(squared_displacement(old, new, self.key_index, pivots)) > max(
            self.constants.teleport, _TELEPORT_SPEED * dt
        )

    def is_moment(self, state: RopesState, frames: Transforms, dt: float) -> bool:
        """Returns whether a step is too short for the way of the body in it, which then says nothing about its speed.

        A game that draws two frames at once asks for the next pose after microseconds.

        Args:
            state: The state before.
            frames: Skin transforms of the body at the end of the step, float64.
            dt: Length of the step [s].
        """
        if dt >= _MOMENT:
            return False
        moved = self.carriage.positions_in(frames, state.kinematic_rest) - state.positions[self.kinematic]
        return bool(np.linalg.norm(moved, axis=1).max() > max(_MOMENT_DISTANCE, _TELEPORT_SPEED * dt))

    def _carry_along(self, state: RopesState, frames: np.ndarray) -> RopesState:
        """Returns the state moved rigidly with the key joint, with velocities and history as they were."""
        old, new = state.frames[self.key_index], frames[self.key_index]
        turn = new[:, :3] @ old[:, :3].T
        positions = (state.positions - old[:, 3]) @ turn.T + new[:, 3]
        positions[self.kinematic] = self.carriage.positions_in(frames, state.kinematic_rest)
        turned = {
            name: getattr(state, name) @ turn.T for name in ("velocities", "kinematic_velocities", "kinematic_rates")
        }
        return replace(state, positions=positions, frames=frames, **turned)

    def _follow_teleport(self, state: RopesState, frames: np.ndarray) -> RopesState:
        """Returns the state moved rigidly with the key joint, with velocities relative to it and without history."""
        old, new = state.frames[self.key_index], frames[self.key_index]
        turn = new[:, :3] @ old[:, :3].T
        positions = (state.positions - old[:, 3]) @ turn.T + new[:, 3]
        positions[self.kinematic] = self.carriage.positions_in(frames, state.kinematic_rest)
        velocities = (state.velocities - state.kinematic_velocities.mean(0)) @ turn.T
        return replace(state, positions=positions, velocities=velocities, frames=frames, last_dt=np.zeros(()))

    def _primitives_of(self, shaped: "ShapedBody") -> BodyPrimitives:
        if np.array_equal(np.asarray(shaped.betas, np.float64), self.betas):
            return self.primitives
        return BodyPrimitives.fit(shaped)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns all arrays by name, as model files hold them."""
        arrays = {name: getattr(self.chains, name) for name in CHAIN_ARRAYS}
        arrays |= {"corners": self.embedding.corners, "barycentric": self.embedding.barycentric}
        arrays |= {f"carriage_{name}": getattr(self.carriage, name) for name in CARRIAGE_ARRAYS}
        return arrays | {"rest": self.rest, "betas": self.betas} | self.primitives.arrays()

    def metadata(self) -> dict[str, Any]:
        """Returns the entries of a model file that are not arrays, as JSON-like values."""
        return {
            "constants": self.constants.as_dict(),
            "key_joint": self.key_joint,
            "proxy_names": list(self.primitives.names),
        }


def _hook_accelerations(hook: Hook, positions: Nodes, velocities: Nodes) -> Nodes:
    push = np.ascontiguousarray(hook(positions, velocities), np.float64)
    if push.shape != positions.shape or not np.isfinite(push).all():
        got = f"shape {push.shape}" if push.shape != positions.shape else "NaN or infinity"
        raise BadInput(f"a hook returns finite accelerations {positions.shape}", got, "correct the hook of the ropes")
    return push
