"""How fast the people in the takes of a fit run and turn."""

import warnings

import numpy as np

from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.errors import HemlineWarning
from hemline.motions import Motion
from hemline.motions.quaternions import heading, to_axis_angle

RUN_M_S, TURN_RAD_S = 2.2, 1.2
"""Speed of a slow run [m/s]; rate of a brisk turn on the spot [rad/s]."""
SECONDS = 0.5
"""Time over which speed and rate are averaged [s]."""


def warn_of_missing_motion(source: TakeFrames) -> None:
    """Warns before anything is fitted if no take to train on shows a run, or none a turn.

    The correction of the bones is linear in the motion of the body, so what is faster than all takes is extrapolated.

    Warns:
        HemlineWarning: No take is as fast as `RUN_M_S`, or none turns as fast as `TURN_RAD_S`.
    """
    pairs = zip(source.rows, source.sides, strict=True)
    ranges = [speed_and_turn(source.dataset.take(row).motion) for row, side in pairs if side == 0]
    speed, turn = (max(each) for each in zip(*ranges, strict=True))
    name = source.dataset.garment.name
    if speed < RUN_M_S:
        what, got = f"no take of '{name}' shows a run", f"speeds of up to {speed:.1f} m/s"
        warnings.warn(HemlineWarning(what, got, "simulate clips that run, or expect it to lag there"), stacklevel=3)
    if turn < TURN_RAD_S:
        what, got = f"no take of '{name}' shows a turn", f"turns of up to {np.degrees(turn):.0f} degrees a second"
        warnings.warn(HemlineWarning(what, got, "simulate clips that turn, or expect it to lag there"), stacklevel=3)


def speed_and_turn(motion: Motion) -> tuple[float, float]:
    """Returns the highest horizontal speed of the pelvis [m/s], and its highest rate of turning [rad/s]."""
    step = min(max(1, round(SECONDS * motion.fps)), max(1, len(motion) - 1))
    seconds = step / motion.fps
    if len(motion) < 2:
        return 0.0, 0.0
    path = motion.translations[:, [0, 2]].astype(np.float64)
    speed = np.linalg.norm(path[step:] - path[:-step], axis=1).max() / seconds
    angles = np.unwrap(to_axis_angle(heading(motion.rotations[:, 0].astype(np.float64)))[:, 1])
    return float(speed), float(np.abs(angles[step:] - angles[:-step]).max() / seconds)
