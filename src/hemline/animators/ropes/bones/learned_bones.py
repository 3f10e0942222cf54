"""Learned bones: a small network in a closed loop with what it made before, a second source of bones besides ropes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from hemline.animators.teleport import RigidTransform
from hemline.arrays import Float, Nodes, Transforms
from hemline.collide.primitives.proxy import Colliders
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, entry
from hemline.learning.mlp import Mlp

from .body_input_kernels import see_body
from .body_inputs import COUNT, SEEN, BodyAtRest
from .bone_contact_kernels import push_points_out

MOST_STEPS = 16
"""Full steps within one frame; a frame that takes longer is taken for one of so many."""
NEARLY = 1e-6
"""A frame that ends so near to a full step, as a share of it, ends with it."""
NARROWEST = 0.02
"""The range of an input that hardly moved in the training is taken to be this wide."""


@dataclass(frozen=True, eq=False)
class LearnedBonesState:
    """Learned bones at one moment. All float64."""

    positions: Float[np.ndarray, "2 free 3"]
    """Free bones in the world one step before the last full step, and at it [m]."""
    bodies: Float[np.ndarray, "3 joints 3 4"]
    """Skin transforms of the body one step before the last full step, at it, and in the last frame."""
    elapsed: Float[np.ndarray, ""]
    """Time from the last full step to the last frame [s]."""

    def copy(self) -> "LearnedBonesState":
        """The same state in arrays of its own."""
        return replace(self, **{field.name: getattr(self, field.name).copy() for field in fields(self)})

    def relocate(self, way: RigidTransform) -> "LearnedBonesState":
        """The same state turned and shifted as a whole, its past too."""
        return replace(self, positions=way.points(self.positions), bodies=way.frames(self.bodies))

    def carried_along(self, key: int, frames: Transforms) -> "LearnedBonesState":
        """The state moved rigidly, past and all, so that the key joint of the last frame is where it is in others."""
        old, new = self.bodies[2, key], frames[key]
        turn = new[:, :3] @ old[:, :3].T
        bodies = turn @ self.bodies
        bodies[..., 3] += new[:, 3] - turn @ old[:, 3]
        return replace(self, positions=(self.positions - old[:, 3]) @ turn.T + new[:, 3], bodies=bodies)


@dataclass(frozen=True, eq=False)
class BonesStep:
    """What a frame brings."""

    state: LearnedBonesState
    positions: Float[np.ndarray, "free 3"]
    """The free bones now [m]."""
    velocities: Float[np.ndarray, "free 3"]
    """Their mean velocities since the last full step [m/s]."""
    beyond: float
    """How far an input, or what came of it, is out of the range of the training, as a share of that; 0 within it."""


@dataclass(frozen=True, eq=False)
class LearnedBones:
    r"""Where the free bones of a garment are $h$ seconds after the last two steps.

    In the frame of the key joint, with $c$ and $\dot c$ the coefficients of the bones of the last step and of their way
    in it, both carried by inertia into the new frame, and with $b$ what the body does there (`body_inputs`), all kept
    within the range of the training, as $c'$ is:

    $$c' = c + s\,\dot c + s^2\,g(b, c, \dot c), \qquad s = \tau / h$$

    Bones that then are nearer to the body's primitives than the clearance, or than at rest where that is less, are
    pushed out. $g$ is zero where body and bones are at rest: the settled drape is an equilibrium.

    Full steps, $s = 1$, are $h$ apart whatever the frame rate, and only they are gone on from; a frame in between is a
    shorter step from the last full one. Where a frame passes a full step the body there is interpolated.
    """

    modes: Float[np.ndarray, "modes rows"]
    """Orthonormal principal directions of the displacements of the free bones, float32."""
    network: Mlp
    """$g$."""
    low: Float[np.ndarray, " ins"]
    r"""Least value of each of the inputs $b, c, \dot c$ in the training, float32."""
    high: Float[np.ndarray, " ins"]
    """Largest value."""
    seconds: float
    """$h$ [s]."""
    clearance: float
    """Least distance of a bone to the primitives, unless it is nearer at rest [m]."""

    @cached_property
    def _modes(self) -> Float[np.ndarray, "modes rows"]:
        return self.modes.astype(np.float64)

    @cached_property
    def _widths(self) -> Float[np.ndarray, " ins"]:
        return np.maximum(self.high - self.low, NARROWEST)

    def start(self, positions: Nodes, frames: Transforms) -> LearnedBonesState:
        """At rest.

        Args:
            positions: The free bones in the world [m].
            frames: Skin transforms of the body, float64.
        """
        return LearnedBonesState(np.stack([positions] * 2), np.stack([frames] * 3), np.zeros(()))

    def step(
        self,
        state: LearnedBonesState,
        body: BodyAtRest,
        rest: Nodes,
        margins: Float[np.ndarray, " free"],
        colliders: Colliders,
        frames: Transforms,
        dt: float,
    ) -> BonesStep:
        """Advance to a posed body.

        Args:
            state: Where the bones are; not changed.
            body: The body at rest.
            rest: The free bones at rest [m].
            margins: Distance that each keeps from the primitives, see `margins_of` [m].
            colliders: What the bones are kept out of.
            frames: Skin transforms of the body now, float64.
            dt: Time since the state [s]; any.
        """
        h, dt = self.seconds, min(dt, MOST_STEPS * self.seconds)
        positions, bodies, beyond = state.positions, state.bodies, 0.0
        elapsed, past = float(state.elapsed), 0.0
        while elapsed + dt - past >= h * (1 - NEARLY):
            past += h - elapsed
            elapsed = 0.0
            now = frames if past >= dt - NEARLY * h else _between(body, bodies[2], frames, past / dt)
            new, out = self._moved(positions, bodies, body, rest, margins, colliders, now, h)
            positions, beyond = np.stack([positions[1], new]), max(beyond, out)
            bodies = np.stack([bodies[1], now, bodies[2]])
        elapsed += max(dt - past, 0.0)
        bodies = np.stack([bodies[0], bodies[1], frames])
        if elapsed < NEARLY * h:
            after = LearnedBonesState(positions, bodies, np.zeros(()))
            return BonesStep(after, positions[1], (positions[1] - positions[0]) / h, beyond)
        new, out = self._moved(positions, bodies, body, rest, margins, colliders, frames, elapsed)
        after = LearnedBonesState(positions, bodies, np.asarray(elapsed))
        return BonesStep(after, new, (new - positions[1]) / elapsed, max(beyond, out))

    def _moved(
        self,
        positions: np.ndarray,
        bodies: np.ndarray,
        body: BodyAtRest,
        rest: Nodes,
        margins: np.ndarray,
        colliders: Colliders,
        now: Transforms,
        dt: float,
    ) -> tuple[np.ndarray, float]:
        """The bones `dt` after the last full step, and how far anything is out of range."""
        share, key = dt / self.seconds, now[body.key]
        seen, count = np.empty(len(self.low)), len(self.modes)
        see_body(body.joints, body.key, SEEN, bodies[0], bodies[1], now, self.seconds, dt, seen[:COUNT])
        place, way = seen[COUNT : COUNT + count], seen[COUNT + count :]
        place[:] = self._modes @ ((positions[1] - key[:, 3]) @ key[:, :3] - rest).reshape(-1)
        way[:] = self._modes @ ((positions[1] - positions[0]) @ key[:, :3]).reshape(-1)
        kept = np.clip(seen, self.low, self.high)
        found = place + share * way + share**2 * self.network(kept.astype(np.float32))
        reach = slice(COUNT, COUNT + count)
        made = np.clip(found, self.low[reach], self.high[reach])
        out = max((np.abs(seen - kept) / self._widths).max(), (np.abs(found - made) / self._widths[reach]).max())
        moved = (rest + (made @ self._modes).reshape(-1, 3)) @ key[:, :3].T + key[:, 3]
        push_points_out(*colliders[:4], now, margins, moved)
        return moved, float(out)

    def arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds."""
        return {"modes": self.modes, "low": self.low, "high": self.high} | self.network.arrays()

    def metadata(self) -> dict[str, float]:
        """All that is no array, as JSON-like values."""
        return {"seconds": self.seconds, "clearance": self.clearance}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any], *, rows: int) -> Self:
        """Read them back.

        Args:
            arrays: What `arrays` gave.
            metadata: What `metadata` gave.
            rows: Coordinates of all free bones.

        Raises:
            BadModel: Something is missing or of another type or shape, or a range or a time cannot be used.
        """
        modes = array_of(arrays, "modes", "float32", (None, rows))
        low, high = (array_of(arrays, name, "float32", (COUNT + 2 * len(modes),)) for name in ("low", "high"))
        seconds, clearance = (float(entry(metadata, name, float)) for name in ("seconds", "clearance"))
        if not (math.isfinite(seconds) and seconds > 0 and math.isfinite(clearance)):
            raise BadModel("learned bones need a time step above 0 and a clearance", (seconds, clearance), AGAIN)
        if (low > high).any():
            raise BadModel("learned bones need ranges from low to high", "one from high to low", AGAIN)
        network = Mlp.of(arrays, inputs=COUNT + 2 * len(modes), outputs=len(modes))
        return cls(modes, network, low, high, seconds, clearance)


def _between(body: BodyAtRest, one: Transforms, other: Transforms, share: float) -> Transforms:
    """The body at a share of the way between two poses: joints on straight lines, turns blended, made rigid again."""
    places = (1 - share) * body.joints_on(one) + share * body.joints_on(other)
    blended = (1 - share) * one[:, :, :3] + share * other[:, :, :3]
    x = blended[:, :, 0] / np.linalg.norm(blended[:, :, 0], axis=1, keepdims=True)
    y = blended[:, :, 1] - (blended[:, :, 1] * x).sum(1, keepdims=True) * x
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    turns = np.stack([x, y, np.cross(x, y)], axis=2)
    shifts = places - np.einsum("jab,jb->ja", turns, body.joints)
    return np.concatenate([turns, shifts[:, :, None]], axis=2)
