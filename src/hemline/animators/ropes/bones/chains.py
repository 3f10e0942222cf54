"""All bones of a garment: rope chains that swing, and bones that the body carries."""

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
from hemline.collide.primitives.proxy import BodyProxy, Colliders
from hemline.errors import BadInput
from hemline.motions import JOINT_NAMES

from .embedding import Carriage, Embedding

if TYPE_CHECKING:
    from hemline.bodies import PosedBody, ShapedBody

Hook = Callable[[Nodes, Nodes], Nodes]
"""A user's force: positions in the world [m] and velocities [m/s] in, accelerations out [m/s^2], once a step.

All are (nodes, 3)."""

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
SHORTEST, LONGEST = 1e-6, 10.0
"""How short and how long a step may be [s]: a longer one would take seconds, in compiled code that does not stop."""


@dataclass(frozen=True, eq=False)
class Ropes:
    """The bones of a garment: the unattached kinematic ones first, then chain by chain from root to tip."""

    chains: RopeChains
    """The mechanical system; its first node of each chain is kinematic too."""
    embedding: Embedding
    """Each bone as a point of the garment's mesh."""
    carriage: Carriage
    """How the body carries the kinematic bones."""
    rest: Nodes
    """All bones in the body's rest pose, where the garment hangs settled, float64 [m]."""
    proxy: BodyProxy
    """What the chains collide with, on the shape that the garment was made on."""
    betas: Float[np.ndarray, " betas"]
    """That shape."""
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
        """What the chains run on."""
        return self.chains.constants

    @property
    def kinematic(self) -> Int[np.ndarray, " kin"]:
        """Bones that the body carries: unattached ones, then the chains' roots."""
        return self.chains.kinematic

    @cached_property
    def key_index(self) -> int:
        """Index of the key joint."""
        return JOINT_NAMES.index(self.key_joint)

    def with_constants(self, constants: RopeConstants) -> "Ropes":
        """The same bones on other constants."""
        return replace(self, chains=replace(self.chains, constants=constants))

    def embedded(self, vertices: Float[np.ndarray, "*frames verts 3"]) -> Float[np.ndarray, "*frames nodes 3"]:
        """All bones on a garment's mesh, or on each mesh of a clip [m], float64."""
        return self.embedding.embedded(vertices)

    def carried(self, posed: "PosedBody") -> Float[np.ndarray, "kin 3"]:
        """The kinematic bones on a posed body, of any shape [m], float64; its mesh is not needed."""
        return self.carriage.carried(posed.transforms, self.carriage.rest_on(posed.shaped))

    def carried_by(
        self, transforms: Float[np.ndarray, "*frames joints 3 4"], shaped: "ShapedBody"
    ) -> Float[np.ndarray, "*frames kin 3"]:
        """The kinematic bones of a whole clip, from its skin transforms [m], float64."""
        return self.carriage.carried(transforms, self.carriage.rest_on(shaped))

    def excess(self, state: RopesState) -> Float[np.ndarray, " nodes"]:
        """How far each rope is over its length, as a share of it; 0 unless collisions held it there."""
        return self.chains.excess(state.positions)

    def start(self, posed: "PosedBody") -> RopesState:
        """Hang the ropes on a posed body as at rest; they will move along with it from the first step on."""
        proxy = self._proxy_of(posed.shaped)
        frames = proxy.posed(posed)
        rest = self.carriage.rest_on(posed.shaped)
        key = frames[self.key_index]
        shift = posed.shaped.joints[self.key_index] - self.proxy.pivots[self.key_index]
        positions = (self.rest + shift) @ key[:, :3].T + key[:, 3]
        positions[self.kinematic] = self.carriage.carried(frames, rest)
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
            proxy.shapes,
            proxy.centres,
            proxy.pivots,
        )

    def step(self, state: RopesState, posed: "PosedBody", dt: float) -> RopesState:
        """Advance to a posed body.

        Args:
            state: Where the ropes are; not changed.
            posed: The body at the end of the step.
            dt: Length of the step, taken in substeps: from 1 us to 10 s [s]. A `Player` takes any time.

        Returns:
            The next state.

        Raises:
            BadInput: `dt` is out of range, the body's transforms are not finite, or the hook returns something else
                than finite accelerations of all nodes.
        """
        if not (math.isfinite(dt) and dt > 0):
            raise BadInput("a step needs a positive dt", dt, "give seconds, such as 1 / 60")
        if not SHORTEST <= dt <= LONGEST:
            cure = "take several steps, or play it with a Player, which takes any time"
            raise BadInput(f"a step of ropes takes from {SHORTEST:g} to {LONGEST:g} s", f"dt = {dt}", cure)
        dt, frames = float(dt), self.proxy.posed(posed)
        if self.is_teleport(state.frames, frames, state.pivots, dt):
            state = self._carried_along(state, frames)
        motion, velocities = self.driven(state, frames, dt), state.velocities
        if float(state.last_dt) == 0.0:
            # no history: the garment moves along with its roots at first
            velocities = velocities + motion[2, self.chains.offsets[0] :].mean(0)
        push = None if self.hook is None else _pushed(self.hook, state.positions + np.array(posed.origin), velocities)
        colliders = Colliders(self.proxy.kinds, self.proxy.joints, state.shapes, state.centres, state.pivots)
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

    def driven(self, state: RopesState, frames: Transforms, dt: float) -> Float[np.ndarray, "4 kin 3"]:
        """What moves the ropes from outside in a step: of the kinematic bones, as `RopeChains.advance` takes it.

        Args:
            state: Where the ropes are.
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
        """Whether the key joint came farther between two poses than a body moves: the garment is then carried along.

        Args:
            old: Skin transforms before.
            new: Those after.
            pivots: The body's joints at rest [m].
            dt: Time between them [s].
        """
        return math.sqrt(squared_displacement(old, new, self.key_index, pivots)) > max(
            self.constants.teleport, _TELEPORT_SPEED * dt
        )

    def _carried_along(self, state: RopesState, frames: np.ndarray) -> RopesState:
        """The state moved rigidly with the key joint into the new frames, its velocities relative to it, no history."""
        old, new = state.frames[self.key_index], frames[self.key_index]
        turn = new[:, :3] @ old[:, :3].T
        positions = (state.positions - old[:, 3]) @ turn.T + new[:, 3]
        positions[self.kinematic] = self.carriage.carried(frames, state.kinematic_rest)
        velocities = (state.velocities - state.kinematic_velocities.mean(0)) @ turn.T
        return replace(state, positions=positions, velocities=velocities, frames=frames, last_dt=np.zeros(()))

    def _proxy_of(self, shaped: "ShapedBody") -> BodyProxy:
        if np.array_equal(np.asarray(shaped.betas, np.float64), self.betas):
            return self.proxy
        return BodyProxy.fit(shaped)

    def arrays(self) -> dict[str, np.ndarray]:
        """All arrays by name, as files hold them."""
        arrays = {name: getattr(self.chains, name) for name in CHAIN_ARRAYS}
        arrays |= {"corners": self.embedding.corners, "barycentric": self.embedding.barycentric}
        arrays |= {f"carriage_{name}": getattr(self.carriage, name) for name in CARRIAGE_ARRAYS}
        return arrays | {"rest": self.rest, "betas": self.betas} | self.proxy.arrays()

    def metadata(self) -> dict[str, Any]:
        """All that is no array, as JSON-like values."""
        return {
            "constants": self.constants.as_dict(),
            "key_joint": self.key_joint,
            "proxy_names": list(self.proxy.names),
        }


def _pushed(hook: Hook, positions: Nodes, velocities: Nodes) -> Nodes:
    push = np.ascontiguousarray(hook(positions, velocities), np.float64)
    if push.shape != positions.shape or not np.isfinite(push).all():
        got = f"shape {push.shape}" if push.shape != positions.shape else "NaN or infinity"
        raise BadInput(f"a hook returns finite accelerations {positions.shape}", got, "correct the hook of the ropes")
    return push
