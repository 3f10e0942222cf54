"""The body's motion around a garment's key joint, in numbers independent of where it stands and which way it faces."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Joints, Transforms
from hemline.motions import JOINT_NAMES

_OMITTED_JOINTS = ("left_foot", "right_foot", "neck", "head", "left_hand", "right_hand")
INPUT_JOINTS = np.array([k for k, name in enumerate(JOINT_NAMES) if name not in _OMITTED_JOINTS])
"""Joints whose place is an input. Hands, feet, neck and head are omitted: they say little about the cloth, and how a
few dancers move them does not generalise."""
BODY_INPUT_COUNT = 6 + 3 * len(INPUT_JOINTS)
"""Number of inputs that `body_inputs` returns."""
REST_INPUTS = np.zeros(BODY_INPUT_COUNT, np.float32)
"""Inputs from a body that stands still in its rest pose: gravity points down, all others are zero."""
REST_INPUTS[1] = -1


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
    then: Float[Transforms, "*frames"],
    now: Float[Transforms, "*frames"],
    dt: float,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Float[np.ndarray, "*frames ins"]:
    """Returns the motion of the body as the correction of the ropes' bones sees it, float64.

    The velocity is relative to the air, since a garment hangs in a wind as on a body that moves against it. The rate of
    rotation is not among the inputs, since it would bring the noise of motion capture into the cloth.

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
    key = now[..., rest.key, :, :]
    before, places = rest.joints_on(then), rest.joints_on(now)
    velocity = (places[..., rest.key, :] - before[..., rest.key, :]) / dt - np.asarray(wind, np.float64)
    here = (places[..., INPUT_JOINTS, :] - key[..., None, :, 3]) @ key[..., :3] - rest.joints[INPUT_JOINTS]
    parts = [
        -key[..., 1, :3],
        np.einsum("...ab,...a->...b", key[..., :3], velocity),
        here.reshape(*here.shape[:-2], -1),
    ]
    return np.concatenate(parts, axis=-1)
