"""Tells how far limbs that overlap in a clip were moved out of each other."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Quaternions
from hemline.motions import Motion
from hemline.motions.quaternions import angle, inverse, multiply

from .progress import note

LEAST_DEG = 0.5
"""Turns of a joint below this are not told [degrees]."""


def note_untangled(motion: Motion, rotations: Sequence[Quaternions]) -> None:
    """Prints in how many frames limbs were moved out of each other, and how far; nothing if in none.

    Args:
        motion: The clip at the rate at which it was played.
        rotations: Local rotations of each frame that was played (joints, 4).
    """
    played = np.array(rotations, np.float64)
    own = motion.rotations[: len(played)].astype(np.float64)
    degrees = np.rad2deg(angle(multiply(played, inverse(own)))).max(axis=1)
    turned = int((degrees > LEAST_DEG).sum())
    if turned:
        note(
            f"limbs overlap in the clip: in {turned} of {len(played)} frames they were moved out of each other, by up"
            f" to {degrees.max():.0f} degrees; --no-untangle plays the clip as it is"
        )
