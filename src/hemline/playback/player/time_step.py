"""Limits on the length of a time step: long enough for meaningful rates, short enough for the frame to stay cheap."""

from hemline.errors import BadInput

SHORTEST_STEP = 1e-4
"""Shortest step [s]; the body stands still in a shorter one, since rounding would look like speed."""
LONGEST_STEP = 0.25
"""Longest step that is played [s]; of a pause the rest is skipped, so that its frame costs no more than others."""
SHORTEST_RUN_UP_STEP = 1e-3
"""Shortest step of a run-up [s], as at 1000 frames per second, the highest rate that `play` accepts."""
LONGEST_PRE_ROLL = 600.0
"""Longest run-up [s]."""


def clamp_dt(dt: float) -> float:
    """Returns the part of a time step that is played [s].

    Args:
        dt: Time since the previous frame [s].

    Raises:
        BadInput: `dt` is not a positive time.
    """
    if not 0 < dt < float("inf"):
        raise BadInput("a frame must take a positive time", f"dt = {dt} s", "give the time since the last frame")
    return min(max(float(dt), SHORTEST_STEP), LONGEST_STEP)


def run_up_steps(pre_roll: float, dt: float) -> tuple[int, float]:
    """Returns the number of steps of a run-up, and the length of each [s].

    Args:
        pre_roll: Time before the first pose [s].
        dt: Requested length of a step [s].

    Raises:
        BadInput: `dt` is not a positive time, or `pre_roll` is negative, not finite or longer than ten minutes.
    """
    step = max(clamp_dt(dt), SHORTEST_RUN_UP_STEP)
    if not 0 <= pre_roll <= LONGEST_PRE_ROLL:
        what = f"a pre-roll takes a time from 0 to {LONGEST_PRE_ROLL:g} s"
        raise BadInput(what, f"pre_roll = {pre_roll} s", "leave it out for 1 s")
    return round(pre_roll / step), step
