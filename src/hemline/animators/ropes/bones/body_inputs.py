"""The body's motion around a garment's key joint, in numbers independent of where it stands and which way it faces."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Joints, Transforms
from hemline.motions import JOINT_NAMES

_OMITTED_JOINTS = ("left_foot", "right_foot", "neck", "head", "left_hand", "right_hand")
INPUT_JOINTS = np.array([k for k, name in enumerate(JOINT_NAMES) if name not in _OMITTED_JOINTS])
"""Joints whose motion is an input. Hands, feet, neck and head are omitted: they say little about the cloth, and how a
few dancers move them does not generalise."""
BODY_INPUT_COUNT = 15 + 6 * len(INPUT_JOINTS)
"""Number of inputs that `body_inputs` returns."""
REST_INPUTS = np.zeros(BODY_INPUT_COUNT, np.float32)
"""Inputs from a body that stands still in its rest pose: gravity points down, all others are zero."""
REST_INPUTS[1] = -1


CORRECTION_INPUTS = np.r_[:6, 15 : 15 + 3 * len(INPUT_JOINTS)]
"""Indices of the inputs among those of `body_inputs` that the correction of the ropes' bones sees: gravity, velocity
and joints. The rate of rotation is not among them, since it brings the noise of motion capture into the cloth."""
CORRECTION_INPUT_COUNT = len(CORRECTION_INPUTS)
CORRECTION_REST_INPUTS = REST_INPUTS[CORRECTION_INPUTS]
"""These inputs from a body that stands still in its rest pose."""
CORRECTION_VELOCITY = slice(3, 6)
"""Velocity of the key joint among these inputs."""


@dataclass(frozen=True, eq=False)
class BodyAtRest:
    """The rest pose of one body shape, from which its motion is measured."""

    key: int
    """Index of the key joint."""
    joints: Joints
    """Joints at rest [m], float64."""

    def joints_on(self, frames: Float[Transforms, "*frames"]) -> Float[Joints, "*frames"]:
        """Returns the joints in one pose or in many [m]."""
        return np.einsum("...jab,jb->...ja", frames[..., :3], self.joints) + frames[..., 3]


def body_inputs(
    rest: BodyAtRest,
    before: Float[Transforms, "*frames"],
    then: Float[Transforms, "*frames"],
    now: Float[Transforms, "*frames"],
    dt_before: float,
    dt: float,
) -> Float[np.ndarray, "*frames ins"]:
    """Returns the body's part of the inputs of the learned bones, float64.

    Args:
        rest: The body at rest.
        before: Skin transforms one step before the last one.
        then: Skin transforms of the last step.
        now: Skin transforms of this step.
        dt_before: Time from `before` to `then` [s].
        dt: Time from `then` to `now` [s].

    Returns:
        In the frame of the key joint: the direction of gravity; the joint's velocity [m/s] and its change [m/s]; its
        rate of rotation (sines of small angles) [1/s] and its change [1/s]; displacements from rest of the joints
        `INPUT_JOINTS` [m], and their velocities [m/s].
    """
    key, turns = rest.key, [frames[..., rest.key, :, :3] for frames in (before, then, now)]
    places = [rest.joints_on(frames) for frames in (before, then, now)]
    velocity = (places[2][..., key, :] - places[1][..., key, :]) / dt
    earlier = (places[1][..., key, :] - places[0][..., key, :]) / dt_before
    spin, spin_earlier = _spin(turns[1], turns[2]) / dt, _spin(turns[0], turns[1]) / dt_before
    here = _in_key(now[..., key, :, :], places[2][..., INPUT_JOINTS, :]) - rest.joints[INPUT_JOINTS]
    there = _in_key(then[..., key, :, :], places[1][..., INPUT_JOINTS, :]) - rest.joints[INPUT_JOINTS]
    parts = [
        -turns[2][..., 1, :],
        _to_key_axes(turns[2], velocity),
        _to_key_axes(turns[2], velocity - earlier),
        spin,
        spin - spin_earlier,
        *(each.reshape(*each.shape[:-2], -1) for each in (here, (here - there) / dt)),
    ]
    return np.concatenate(parts, axis=-1)


def correction_inputs(
    rest: BodyAtRest,
    then: Float[Transforms, "*frames"],
    now: Float[Transforms, "*frames"],
    dt: float,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Float[np.ndarray, "*frames ins"]:
    """Returns the motion of the body as the correction of the ropes' bones sees it, float64.

    Velocities are relative to the air, since a garment hangs in a wind as on a body that moves against it.

    Args:
        rest: The body at rest.
        then: Skin transforms of the last step.
        now: Skin transforms of this step.
        dt: Time from `then` to `now` [s].
        wind: Velocity of the air in the world [m/s].

    Returns:
        In the frame of the key joint: the direction of gravity; the velocity of the joint through the air [m/s];
        displacements from rest of the joints `INPUT_JOINTS` [m].
    """
    found = body_inputs(rest, then, then, now, dt, dt)[..., CORRECTION_INPUTS]
    turn = now[..., rest.key, :, :3]
    found[..., CORRECTION_VELOCITY] -= _to_key_axes(
        turn, np.broadcast_to(np.asarray(wind, np.float64), turn.shape[:-1])
    )
    return found


def _spin(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    turn = np.swapaxes(one, -1, -2) @ two
    return 0.5 * np.stack([turn[..., a, b] - turn[..., b, a] for a, b in ((2, 1), (0, 2), (1, 0))], axis=-1)


def _to_key_axes(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("...ab,...a->...b", turn, vector)


def _in_key(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    return (points - transform[..., None, :, 3]) @ transform[..., :3]
