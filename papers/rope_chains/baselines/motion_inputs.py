"""What recurrent networks see of the body: its pose around the key joint, and how that moves."""

import numpy as np

from hemline.animators.ropes.bones.body_inputs import INPUT_JOINTS, BodyAtRest
from hemline.arrays import Float, Transforms

MOTION_INPUT_COUNT = 15 + 6 * len(INPUT_JOINTS)
"""Number of inputs that `motion_inputs` returns."""
COLUMNS = {
    "pose": np.r_[:3, 15 : 15 + 3 * len(INPUT_JOINTS)],
    "motion": np.arange(MOTION_INPUT_COUNT),
}
"""Which of `motion_inputs` a network sees: gravity and the pose around the key joint, as in the paper, or also
velocities and accelerations."""


def motion_inputs(
    rest: BodyAtRest,
    before: Float[Transforms, "*frames"],
    then: Float[Transforms, "*frames"],
    now: Float[Transforms, "*frames"],
    dt: float,
) -> Float[np.ndarray, "*frames ins"]:
    """Returns the motion of the body around the key joint, float64.

    Args:
        rest: The body at rest.
        before: Skin transforms one step before the last one.
        then: Skin transforms of the last step.
        now: Skin transforms of this step.
        dt: Time between them [s].

    Returns:
        In the frame of the key joint: the direction of gravity; the joint's velocity [m/s] and its change [m/s]; its
        rate of rotation (sines of small angles) [1/s] and its change [1/s]; displacements from rest of the joints
        `INPUT_JOINTS` [m], and their velocities [m/s].
    """
    key, turns = rest.key, [frames[..., rest.key, :, :3] for frames in (before, then, now)]
    places = [rest.joints_on(frames) for frames in (before, then, now)]
    velocity = (places[2][..., key, :] - places[1][..., key, :]) / dt
    earlier = (places[1][..., key, :] - places[0][..., key, :]) / dt
    spin, spin_earlier = _spin(turns[1], turns[2]) / dt, _spin(turns[0], turns[1]) / dt
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


def _spin(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    turn = np.swapaxes(one, -1, -2) @ two
    return 0.5 * np.stack([turn[..., a, b] - turn[..., b, a] for a, b in ((2, 1), (0, 2), (1, 0))], axis=-1)


def _to_key_axes(turn: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.einsum("...ab,...a->...b", turn, vector)


def _in_key(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    return (points - transform[..., None, :, 3]) @ transform[..., :3]
