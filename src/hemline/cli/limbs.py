"""Tells how far limbs that overlap in a clip were moved out of each other, and whether arms were turned back."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Quaternions
from hemline.motions import Motion
from hemline.motions.arm_twist import steady_arm_twist
from hemline.motions.quaternions import angle, inverse, multiply

from .progress import note

LEAST_DEG = 0.5
"""Turns of a joint below this are not told [degrees]."""
LEAST_CHANGE = 1e-6
"""Quaternions that differ by less are those of the clip itself."""


def note_untangled(motion: Motion, rotations: Sequence[Quaternions]) -> None:
    """Prints in how many frames limbs were moved out of each other, and how far, and wrung arms turned back.

    Prints nothing if neither was done.

    Args:
        motion: The clip at the rate at which it was played.
        rotations: Local rotations of each frame that was played (joints, 4).
    """
    played = np.array(rotations, np.float64)
    own, steady = (each.rotations[: len(played)].astype(np.float64) for each in (motion, steady_arm_twist(motion)))
    if np.allclose(played, own, atol=LEAST_CHANGE):
        return
    wrung = int((steady != own).any(axis=(1, 2)).sum())
    if wrung:
        note(
            f"straight arms are wrung in the clip: in {wrung} of {len(played)} frames they were turned back about their"
            " bones, and hands were left as they are; --no-untangle plays the clip as it is"
        )
    degrees = np.rad2deg(angle(multiply(played, inverse(steady)))).max(axis=1)
    turned = int((degrees > LEAST_DEG).sum())
    if turned:
        note(
            f"limbs overlap in the clip: in {turned} of {len(played)} frames they were moved out of each other, by up"
            f" to {degrees.max():.0f} degrees; --no-untangle plays the clip as it is"
        )
