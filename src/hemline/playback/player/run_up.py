"""How the body comes from its rest pose to the first pose that is shown."""

import numpy as np

from hemline.bodies.body import ShapedBody
from hemline.bodies.lead_in import lead_in
from hemline.motions.motion import Motion, Pose


def run_up(body: ShapedBody, first: Pose, second: Pose | None, frames: int, dt: float) -> list[Pose]:
    """Poses before the first one, and that one last; it alone without any frames.

    Args:
        body: The body; poses are placed on it.
        first: The first pose that is shown.
        second: Where the pelvis is a time `dt` later, to whose speed the body runs up; None: it stands.
        frames: How many poses come before.
        dt: Time from one to the next [s].
    """
    if frames < 1:
        return [first]
    translations = first.translation[None]
    if second is not None:
        translations = np.stack([first.translation, second.translation])
    rotations = np.repeat(first.rotations[None], len(translations), axis=0)
    poses, _ = lead_in(body, Motion(rotations, translations, 1 / dt, body.leg_length), frames)
    return [*(poses[index] for index in range(len(poses))), first]
