"""Learned bones: a small network in a closed loop with its own output, the second source of bones besides ropes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from hemline.animators.rigid_transform import RigidTransform
from hemline.arrays import Float, Nodes, Transforms
from hemline.collide.primitives.body_primitives import Colliders
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of, entry
from hemline.learning.mlp import Mlp

from .body_input_kernels import write_body_inputs
from .body_inputs import BODY_INPUT_COUNT, INPUT_JOINTS, BodyAtRest
from .bone_contact_kernels import push_points_out

MAX_STEPS_PER_FRAME = 16
"""Largest number of full steps within a frame; a longer frame is shortened to this many."""
STEP_TOLERANCE = 1e-6
"""A frame that ends this near to a full step ends with it, as a fraction of the step."""
NARROWEST_RANGE = 0.02
"""Smallest width of the range of an input, for inputs that hardly varied in the training."""


@dataclass(frozen=True, eq=False)
class LearnedBonesState:
    """Learned bones at one moment. All arrays are float64."""

    positions: Float[np.ndarray, "2 free 3"]
    """Free bones in the world one step before the last full step, and at it [m]."""
    bodies: Float[np.ndarray, "3 joints 3 4"]
    """Skin transforms of the body one step before the last full step, at it, and in the last frame."""
    elapsed: Float[np.ndarray, ""]
    """Time from the last full step to the last frame [s]."""

    def copy(self) -> "LearnedBonesState":
        """Returns a copy with arrays of its own."""
        return replace(self, **{field.name: getattr(self, field.name).copy() for field in fields(self)})

    def relocate(self, transform: RigidTransform) -> "LearnedBonesState":
        """Returns the state rotated and translated as a whole, history included."""
        return replace(self, positions=transform.points(self.positions), bodies=transform.frames(self.bodies))

    def follow_teleport(self, key: int, frames: Transforms) -> "LearnedBonesState":
        """Returns the state moved rigidly, history included, so that the key joint is where `frames` has it."""
        old, new = self.bodies[2, key], frames[key]
        turn = new[:, :3] @ old[:, :3].T
        bodies = turn @ self.bodies
        bodies[..., 3] += new[:, 3] - turn @ old[:, 3]
        return replace(self, positions=(self.positions - old[:, 3]) @ turn.T + new[:, 3], bodies=bodies)


@dataclass(frozen=True, eq=False)
class BonesStep:
    """The result of stepping learned bones by one frame."""

    state: LearnedBonesState
    positions: Float[np.ndarray, "free 3"]
    """The free bones now [m]."""
    velocities: Float[np.ndarray, "free 3"]
    """Mean velocities of the free bones since the last full step [m/s]."""
    beyond: float
    """Largest distance of an input or output from the range of the training, as a fraction of it; 0 within."""


@dataclass(frozen=True, eq=False)
class LearnedBones:
    r"""Predicts the free bones of a garment $h$ seconds after the last two steps.

    In the frame of the key joint, $c$ and $\dot c$ are the coefficients of the bones of the last step and of their
    displacement in it, both carried by inertia into the new frame, and $b$ is the body's motion (`body_inputs`). All
    are clipped to the range of the training, as $c'$ is:

    $$c' = c + s\,\dot c + s^2\,g(b, c, \dot c), \qquad s = \tau / h$$

    Bones nearer to the body's primitives than the clearance, or than at rest where that is less, are pushed out. $g$ is
    zero where body and bones are at rest, so the settled drape is an equilibrium.

    Full steps, $s = 1$, are $h$ apart at any frame rate, and each full step starts from the one before. A frame in
    between is a shorter step from the last full one. Where a frame passes a full step, the body is interpolated there.
    """

    modes: Float[np.ndarray, "modes rows"]
    """Orthonormal principal directions of the displacements of the free bones, float32."""
    network: Mlp
    """$g$."""
    low: Float[np.ndarray, " ins"]
    r"""Least value of each of the inputs $b, c, \dot c$ in the training, float32."""
    high: Float[np.ndarray, " ins"]
    """Largest value of each of those inputs, float32."""
    seconds: float
    """$h$ [s]."""
    clearance: float
    """Least distance of a bone to the primitives, unless it is nearer at rest [m]."""

    @cached_property
    def _modes(self) -> Float[np.ndarray, "modes rows"]:
        return self.modes.astype(np.float64)

    @cached_property
    def _widths(self) -> Float[np.ndarray, " ins"]:
        return np.maximum(self.high - self.low, NARROWEST_RANGE)

    def start(self, positions: Nodes, frames: Transforms) -> LearnedBonesState:
        """Returns the state at rest.

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
        """Advances to a posed body.

        Args:
            state: The state before; it is not changed.
            body: The body at rest.
            rest: The free bones at rest [m].
            margins: Distance that each bone keeps from the primitives, see `margins_of` [m].
            colliders: The primitives that bones are pushed out of.
            frames: Skin transforms of the body now, float64.
            dt: Time since the state [s]; any.
        """
        h, dt = self.seconds, min(dt, MAX_STEPS_PER_FRAME * self.seconds)
        positions, bodies, beyond = state.positions, state.bodies, 0.0
        elapsed, past = float(state.elapsed), 0.0
        while elapsed + dt - past >= h * (1 - STEP_TOLERANCE):
            past += h - elapsed
            elapsed = 0.0
            now = frames if past >= dt - STEP_TOLERANCE * h else _between(body, bodies[2], frames, past / dt)
            new, out = self._predict(positions, bodies, body, rest, margins, colliders, now, h)
            positions, beyond = np.stack([positions[1], new]), max(beyond, out)
            bodies = np.stack([bodies[1], now, bodies[2]])
        elapsed += max(dt - past, 0.0)
        bodies = np.stack([bodies[0], bodies[1], frames])
        if elapsed < STEP_TOLERANCE * h:
            after = LearnedBonesState(positions, bodies, np.zeros(()))
            return BonesStep(after, positions[1], (positions[1] - positions[0]) / h, beyond)
        new, out = self._predict(positions, bodies, body, rest, margins, colliders, frames, elapsed)
        after = LearnedBonesState(positions, bodies, np.asarray(elapsed))
        return BonesStep(after, new, (new - positions[1]) / elapsed, max(beyond, out))

    def _predict(
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
        """Returns the bones `dt` after the last full step, and the largest distance from the range of the training."""
        s, key = dt / self.seconds, now[body.key]
        inputs, count = np.empty(len(self.low)), len(self.modes)
        of_body = inputs[:BODY_INPUT_COUNT]
        write_body_inputs(body.joints, body.key, INPUT_JOINTS, bodies, now, self.seconds, dt, of_body)
        outputs = slice(BODY_INPUT_COUNT, BODY_INPUT_COUNT + count)
        place, displacement = inputs[outputs], inputs[outputs.stop :]
        place[:] = self._modes @ ((positions[1] - key[:, 3]) @ key[:, :3] - rest).reshape(-1)
        displacement[:] = self._modes @ ((positions[1] - positions[0]) @ key[:, :3]).reshape(-1)
        clipped = np.clip(inputs, self.low, self.high)
        predicted = place + s * displacement + s**2 * self.network(clipped.astype(np.float32))
        new = np.clip(predicted, self.low[outputs], self.high[outputs])
        beyond = (np.abs(inputs - clipped) / self._widths).max()
        beyond = max(beyond, (np.abs(predicted - new) / self._widths[outputs]).max())
        bones = (rest + (new @ self._modes).reshape(-1, 3)) @ key[:, :3].T + key[:, 3]
        push_points_out(*colliders[:4], now, margins, bones)
        return bones, float(beyond)

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file."""
        return {"modes": self.modes, "low": self.low, "high": self.high} | self.network.arrays()

    def metadata(self) -> dict[str, float]:
        """Returns the entries of a model file that are not arrays, as JSON-like values."""
        return {"seconds": self.seconds, "clearance": self.clearance}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any], *, rows: int) -> Self:
        """Reads learned bones from a model file.

        Args:
            arrays: The result of `arrays`.
            metadata: The result of `metadata`.
            rows: Number of coordinates of all free bones, three each.

        Raises:
            BadModel: An entry is missing or of another type or shape, or a range or a time is invalid.
        """
        modes = array_of(arrays, "modes", "float32", (None, rows))
        low, high = (
            array_of(arrays, name, "float32", (BODY_INPUT_COUNT + 2 * len(modes),)) for name in ("low", "high")
        )
        seconds, clearance = (float(entry(metadata, name, float)) for name in ("seconds", "clearance"))
        if not (math.isfinite(seconds) and seconds > 0 and math.isfinite(clearance)):
            raise BadModel("learned bones need a time step above 0 and a clearance", (seconds, clearance), AGAIN)
        if (low > high).any():
            raise BadModel("learned bones need ranges from low to high", "one from high to low", AGAIN)
        network = Mlp.of(arrays, inputs=BODY_INPUT_COUNT + 2 * len(modes), outputs=len(modes))
        return cls(modes, network, low, high, seconds, clearance)


def _between(body: BodyAtRest, one: Transforms, other: Transforms, fraction: float) -> Transforms:
    """Interpolates between two poses: joints on straight lines, rotations blended and made orthonormal again."""
    places = (1 - fraction) * body.joints_on(one) + fraction * body.joints_on(other)
    blended = (1 - fraction) * one[:, :, :3] + fraction * other[:, :, :3]
    x = blended[:, :, 0] / np.linalg.norm(blended[:, :, 0], axis=1, keepdims=True)
    y = blended[:, :, 1] - (blended[:, :, 1] * x).sum(1, keepdims=True) * x
    y /= np.linalg.norm(y, axis=1, keepdims=True)
    turns = np.stack([x, y, np.cross(x, y)], axis=2)
    shifts = places - np.einsum("jab,jb->ja", turns, body.joints)
    return np.concatenate([turns, shifts[:, :, None]], axis=2)
