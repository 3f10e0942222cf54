"""Finds the longest part of a clip without tracking errors, which appear as jumps."""

import numpy as np

from hemline.arrays import Float

from .motion import JOINT_NAMES, Motion, Pose
from .quaternions import angle, inverse, multiply

JUMP_DEG_S = 3000.0
"""A body joint that turns faster than this was lost by the cameras [deg/s]."""

TUMBLE_DEG_S = 1500.0
"""A pelvis that turns faster than this was lost by the cameras; gymnasts and divers reach about 1000 [deg/s]."""

JUMP_M_S = 20.0
"""A pelvis that moves faster than this was lost by the cameras; sprinters reach 12 [m/s]."""

_UNJUDGED = ("head", "collar", "foot", "wrist", "hand")
_JUDGED = [index for index, name in enumerate(JOINT_NAMES) if not name.endswith(_UNJUDGED)]
_LIMITS_DEG_S = np.array([TUMBLE_DEG_S if JOINT_NAMES[index] == "pelvis" else JUMP_DEG_S for index in _JUDGED])
_COLLARS, _SHOULDERS = (
    [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right")] for name in ("collar", "shoulder")
)


def longest_clean(motion: Motion) -> tuple[int, int]:
    """Returns the longest part without a jump, as its first frame and the one after its last: `motion[first:end]`.

    Jumps are those of trunk and limbs, of the upper arms relative to the chest, and of the path of the pelvis. Head,
    hands and toes are ignored, since they are noisy in most recordings.
    """
    turning_deg_s, moving = _speeds(motion.rotations, motion.translations, motion.fps)
    jumps = np.flatnonzero((turning_deg_s > _LIMITS_DEG_S).any(axis=1) | (moving > JUMP_M_S))
    borders = np.concatenate([[0], jumps + 1, [len(motion)]])
    longest = int(np.argmax(np.diff(borders)))
    return int(borders[longest]), int(borders[longest + 1])


def jump(first: Pose, second: Pose, seconds: float) -> str:
    """Describes what jumps from one pose to the next, by the rules of `longest_clean`; empty if nothing does."""
    rotations, translations = np.stack([first.rotations, second.rotations]), [first.translation, second.translation]
    turning_deg_s, moving = _speeds(rotations, np.stack(translations), 1 / seconds)
    worst = int((turning_deg_s[0] / _LIMITS_DEG_S).argmax())
    if moving[0] > JUMP_M_S:
        return f"the pelvis moves at {moving[0]:.3g} m/s"
    if turning_deg_s[0, worst] > _LIMITS_DEG_S[worst]:
        return f"the {JOINT_NAMES[_JUDGED[worst]]} turns at {turning_deg_s[0, worst]:.4g} deg/s"
    return ""


def _speeds(
    rotations: Float[np.ndarray, "frames joints 4"], translations: Float[np.ndarray, "frames 3"], fps: float
) -> tuple[Float[np.ndarray, "steps judged"], Float[np.ndarray, " steps"]]:
    """Returns the angular speed of the judged joints [deg/s], and the speed of the pelvis [m/s]."""
    rotations = rotations.astype(np.float64)
    rotations[:, _SHOULDERS] = multiply(rotations[:, _COLLARS], rotations[:, _SHOULDERS])
    rotations = rotations[:, _JUDGED]
    turning_deg_s = np.degrees(angle(multiply(inverse(rotations[:-1]), rotations[1:]))) * fps
    return turning_deg_s, np.linalg.norm(np.diff(translations.astype(np.float64), axis=0), axis=1) * fps
