"""The run-up of a body from its rest pose to the first pose that is shown."""

import numpy as np

from hemline.bodies.body import ShapedBody
from hemline.bodies.lead_in import lead_in
from hemline.motions.motion import Motion, Pose


def run_up(body: ShapedBody, first: Pose, second: Pose | None, frames: int, dt: float) -> list[Pose]:
    """Returns the poses of the run-up, followed by the first pose that is shown.

    Args:
        body: The body; poses are placed on it.
        first: The first pose that is shown.
        second: The pose a time `dt` later, to whose speed the body accelerates; None: it stands.
        frames: Number of poses before the first one.
        dt: Time between poses [s].
    """
    if frames < 1:
        return [first]
    translations = first.translation[None]
    if second is not None:
        translations = np.stack([first.translation, second.translation])
    rotations = np.repeat(first.rotations[None], len(translations), axis=0)
    poses, _ = lead_in(body, Motion(rotations, translations, 1 / dt, body.leg_length), frames)
    return [*(poses[index] for index in range(len(poses))), first]
