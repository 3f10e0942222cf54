"""How long a frame is taken to last: neither so short that rates are noise, nor so long that it takes seconds."""

from hemline.errors import BadInput

SHORTEST_STEP = 1e-4
"""A shorter frame is taken for one of this length, in which the body goes nowhere [s]: else rounding would be speed."""
LONGEST_STEP = 0.25
"""Of a longer frame only this much is played [s]: after a pause the next frame must not take longer than others."""
SHORTEST_RUN_UP_STEP = 1e-3
"""Shortest step of a run-up [s]: as at 1000 frames a second, the highest rate that `play` takes."""
LONGEST_PRE_ROLL = 600.0
"""A run-up takes no longer [s]."""


def clamp_dt(dt: float) -> float:
    """How much of a frame is played [s].

    Args:
        dt: Time since the frame before [s].

    Raises:
        BadInput: It is not a positive time.
    """
    if not 0 < dt < float("inf"):
        raise BadInput("a frame must take a positive time", f"dt = {dt} s", "give the time since the last frame")
    return min(max(float(dt), SHORTEST_STEP), LONGEST_STEP)


def run_up_steps(pre_roll: float, dt: float) -> tuple[int, float]:
    """How many steps a run-up takes, and how long each is [s].

    Args:
        pre_roll: Time before the first pose [s].
        dt: Length of a step that is asked for [s].

    Raises:
        BadInput: `dt` is not a positive time, or `pre_roll` is negative, not finite or longer than ten minutes.
    """
    step = max(clamp_dt(dt), SHORTEST_RUN_UP_STEP)
    if not 0 <= pre_roll <= LONGEST_PRE_ROLL:
        what = f"a pre-roll takes a time from 0 to {LONGEST_PRE_ROLL:g} s"
        raise BadInput(what, f"pre_roll = {pre_roll} s", "leave it out for 1 s")
    return round(pre_roll / step), step
