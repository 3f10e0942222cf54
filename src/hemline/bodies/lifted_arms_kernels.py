"""Compiled kernel that turns upper arms away from the torso."""

import math

from hemline.compiled import kernel


@kernel
def lift_arms(arms, sides, most, low, high, arms_out):
    """Lifts upper arms that hang.

    Reads: arms (arms, 4): unit quaternions wxyz; sides (arms,): 1 for an arm that points along +x where nothing turns,
        -1 for the other; most: angle by which an arm that hangs is lifted [rad]; low, high: angles from straight down
        between which that fades [rad].
    Writes: arms_out (arms, 4).
    """
    # the arm points to R(q) (side, 0, 0), whose height is 2 side (x y + w z); it turns about (0, 0, side)
    for i in range(arms.shape[0]):
        w, x, y, z = arms[i, 0], arms[i, 1], arms[i, 2], arms[i, 3]
        hanging = math.acos(min(1.0, max(-1.0, -2.0 * sides[i] * (x * y + w * z))))
        fraction = min(1.0, max(0.0, (hanging - low) / (high - low)))
        half = 0.5 * most * (1.0 - fraction * fraction * (3.0 - 2.0 * fraction))
        c, s = math.cos(half), sides[i] * math.sin(half)
        arms_out[i, 0], arms_out[i, 1], arms_out[i, 2], arms_out[i, 3] = (
            c * w - s * z,
            c * x - s * y,
            c * y + s * x,
            c * z + s * w,
        )
