"""The bones of arms and legs as segments: what must never go through cloth."""

import numpy as np

from hemline.arrays import Float, Joints
from hemline.motions.motion import JOINT_NAMES

_ENDS = {"thigh": ("hip", "knee"), "shin": ("knee", "ankle"), "upper arm": ("shoulder", "elbow")}
_ENDS |= {"forearm": ("elbow", "wrist")}
LIMBS: tuple[str, ...] = tuple(f"{side} {limb}" for limb in _ENDS for side in ("left", "right"))
"""Names of the limbs, in the order of `limb_bones`."""
_JOINTS = np.array(
    [[JOINT_NAMES.index(f"{side}_{end}") for end in ends] for ends in _ENDS.values() for side in ("left", "right")]
)
BARE_END = 0.15
"""Fraction of a bone at each end that does not count: in a sharp bend cloth is pinched between skin and joint."""


def limb_bones(joints: Float[np.ndarray, "*frames joints 3"] | Joints) -> Float[np.ndarray, "*frames limbs 2 3"]:
    """Returns the middle part of the bone of each limb, thighs, shins, upper arms and forearms, left before right.

    Hands, feet and trunk are left out: too long a sleeve lies in folds on the hand, and cloth is pinched in armpits.

    Args:
        joints: Positions of the joints of a posed body, or of each pose of a clip [m].

    Returns:
        Both ends of each segment [m], float64.
    """
    ends = np.asarray(joints, np.float64)[..., _JOINTS, :]
    trim = BARE_END * (ends[..., ::-1, :] - ends)
    return ends + trim
