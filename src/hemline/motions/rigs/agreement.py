"""Compares the directions of bones after retargeting with those of the source's own skeleton."""

from collections.abc import Mapping

import numpy as np

from hemline.arrays import Float
from hemline.motions.motion import JOINT_NAMES
from hemline.motions.quaternions import Quaternion, rotate

from .quarters import FORWARD, LEFT, OUT, UP
from .rig import Rig

MEAN_DEG = 25.0
"""A clip is not read if its bones are off by more than this in the mean over bones and frames."""
BONE_DEG = 35.0
"""A bone that is off by more than this in the mean over the frames is named in a warning."""

_LINES = {
    "the hips": ("pelvis", LEFT, "right_hip", "left_hip"),
    "the shoulders": ("spine3", LEFT, "right_shoulder", "left_shoulder"),
    "the trunk": ("spine2", UP, "pelvis", "neck"),
    "the neck": ("neck", UP, "neck", "head"),
} | {
    f"the {side} {bone}": line
    for side in OUT
    for bone, line in {
        "thigh": (f"{side}_hip", -UP, f"{side}_hip", f"{side}_knee"),
        "shank": (f"{side}_knee", -UP, f"{side}_knee", f"{side}_ankle"),
        "upper arm": (f"{side}_shoulder", OUT[side], f"{side}_shoulder", f"{side}_elbow"),
        "forearm": (f"{side}_elbow", OUT[side], f"{side}_elbow", f"{side}_wrist"),
    }.items()
}
"""Each bone: the joint that turns it, its direction in our T-pose, and the joints of the rig at its ends."""
_FOOT_FREE_DEG = 35.0
"""Angle by which a foot slopes down from ankle to ball, and somewhat more [deg]."""
_FREE_DEG = {"the neck": 25.0, "the trunk": 15.0, "the shoulders": 15.0}
"""Angles by which these stand off those directions in a T-pose."""


def bone_errors(rig: Rig, turn: Quaternion, turned: Float[np.ndarray, "frames 24 4"]) -> dict[str, float]:
    """Returns the mean angle between each main bone of our body and the same bone of the source [deg].

    Args:
        rig: The source in some frames, in the file's axes.
        turn: The rotation of these axes to ours.
        turned: Global rotations of our joints in the same frames.
    """
    places = dict(rig.match.joints)
    places.setdefault("neck", places["head"])
    middle = 0.5 * (rig.path("left_hip") + rig.path("right_hip"))
    errors = {}
    for side in OUT:
        if (sole := rig.sole(side)) is not None:
            theirs = rotate(turn, rotate(rig.rotations[:, places[f"{side}_ankle"]], sole))
            ours = rotate(turned[:, JOINT_NAMES.index(f"{side}_ankle")], FORWARD)
            errors[f"the {side} foot"] = max(_apart_deg(theirs, ours) - _FOOT_FREE_DEG, 0.0)
    for bone, (joint, direction, start, end) in _LINES.items():
        if start not in places or end not in places or places[start] == places[end]:
            continue
        first = middle if start == "pelvis" else rig.positions[:, places[start]]
        theirs = rotate(turn, rig.positions[:, places[end]] - first)
        lengths = np.linalg.norm(theirs, axis=1)
        if lengths.min() < 1e-3 * rig.leg_length():
            continue
        ours = rotate(turned[:, JOINT_NAMES.index(joint)], direction)
        errors[bone] = max(_apart_deg(theirs, ours) - _FREE_DEG.get(bone, 0.0), 0.0)
    return errors


def _apart_deg(first: Float[np.ndarray, "frames 3"], second: Float[np.ndarray, "frames 3"]) -> float:
    """Returns the mean angle between vectors [deg]."""
    lengths = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    cosines = np.sum(first * second, axis=1) / np.maximum(lengths, 1e-12)
    return float(np.degrees(np.arccos(np.clip(cosines, -1, 1))).mean())


def worst_bones(errors: Mapping[str, float], limit: float) -> str:
    """Returns the bones whose error is above a limit, the worst first, as words."""
    worst = sorted((bone for bone in errors if errors[bone] > limit), key=lambda bone: -errors[bone])
    return ", ".join(f"{bone} by {errors[bone]:.0f} degrees" for bone in worst[:4])
