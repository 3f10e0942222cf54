"""What the body does around a garment's key joint, in numbers that do not say where in the world it stands or looks."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Joints, Transforms
from hemline.motions import JOINT_NAMES

_UNSEEN = ("left_foot", "right_foot", "neck", "head", "left_hand", "right_hand")
SEEN = np.array([k for k, name in enumerate(JOINT_NAMES) if name not in _UNSEEN])
"""Joints that are looked at: ends of limbs say little about cloth, and what they say of a few dancers is not so."""
COUNT = 15 + 6 * len(SEEN)
"""How many numbers `body_inputs` gives."""
AT_REST = np.zeros(COUNT, np.float32)
"""Those of a body that stands still in its rest pose: gravity points down, and nothing else is there."""
AT_REST[1] = -1


@dataclass(frozen=True, eq=False)
class BodyAtRest:
    """What the motion of one body shape is measured from."""

    key: int
    """Index of the key joint."""
    joints: Joints
    """Its joints at rest [m], float64."""

    def joints_on(self, frames: Float[Transforms, "*frames"]) -> Float[Joints, "*frames"]:
        """The joints in one pose or in many [m]."""
        return np.einsum("...jab,jb->...ja", frames[..., :3], self.joints) + frames[..., 3]


def body_inputs(
    rest: BodyAtRest,
    before: Float[Transforms, "*frames"],
    then: Float[Transforms, "*frames"],
    now: Float[Transforms, "*frames"],
    dt_before: float,
    dt: float,
) -> Float[np.ndarray, "*frames ins"]:
    """The body's part of the inputs of the learned bones, float64.

    Args:
        rest: Its joints at rest.
        before: Skin transforms one step before the last.
        then: Those of the last step.
        now: Those of this one.
        dt_before: Time from `before` to `then` [s].
        dt: Time from `then` to `now` [s].

    Returns:
        Of the key joint, in its own frame: the direction of gravity, velocity [m/s], its change [m/s], rate of turn
        (sines of small angles) [1/s], its change [1/s]; displacements of the joints `SEEN` from rest in the frame of
        the key joint [m], their velocities there [m/s].
    """
    key, turns = rest.key, [frames[..., rest.key, :, :3] for frames in (before, then, now)]
    places = [rest.joints_on(frames) for frames in (before, then, now)]
    velocity = (places[2][..., key, :] - places[1][..., key, :]) / dt
    earlier = (places[1][..., key, :] - places[0][..., key, :]) / dt_before
    spin, spin_earlier = _spin(turns[1], turns[2]) / dt, _spin(turns[0], turns[1]) / dt_before
    here = _in_key(now[..., key, :, :], places[2][..., SEEN, :]) - rest.joints[SEEN]
    there = _in_key(then[..., key, :, :], places[1][..., SEEN, :]) - rest.joints[SEEN]
    parts = [
        -turns[2][..., 1, :],
        _turned_back(turns[2], velocity),
        _turned_back(turns[2], velocity - earlier),
        spin,
        spin - spin_earlier,
        *(each.reshape(*each.shape[:-2], -1) for each in (here, (here - there) / dt)),
    ]
    return np.concatenate(parts, axis=-1)


def _spin(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    turn = np.swapaxes(one, -1, -2) @ two
    return 0.5 * np.stack([turn[..., a, b] - turn[..., b, a] for a, b in ((2, 1), (0, 2), (1, 0))], axis=-1)


def _turned_back(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("...ab,...a->...b", turn, vector)


def _in_key(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    return (points - transform[..., None, :, 3]) @ transform[..., :3]
