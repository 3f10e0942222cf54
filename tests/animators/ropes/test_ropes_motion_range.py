"""A fit says before it starts if nobody in its takes runs or turns."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from hemline import motions
from hemline.animators.ropes.fit.motion_range import speed_and_turn, warn_of_missing_motion
from hemline.errors import HemlineWarning
from hemline.motions import Motion
from hemline.motions.quaternions import from_axis_angle


def travelling(speed, turn, seconds=3.0, fps=60.0):
    """Someone who moves along z at a speed [m/s] and spins at a rate [rad/s]."""
    times = np.arange(round(seconds * fps)) / fps
    rotations = np.tile(np.array([1.0, 0, 0, 0], np.float32), (len(times), 24, 1))
    rotations[:, 0] = from_axis_angle(np.outer(turn * times, [0.0, 1.0, 0.0]))
    path = np.outer(times, [0.0, 0.3, speed]).astype(np.float32)  # rising does not count
    return Motion(rotations, path, fps, 0.8, "travelling")


@pytest.mark.parametrize(("speed", "turn"), [(0.0, 0.0), (1.3, 0.4), (3.5, 4.0)])
def test_speed_and_turn_of_steady_motion_are_found_at_any_rate(speed, turn):
    for fps in (24.0, 60.0, 120.0):
        assert speed_and_turn(travelling(speed, turn, fps=fps)) == pytest.approx((speed, turn), rel=1e-3, abs=1e-3)


def test_shipped_run_runs_the_turn_turns_and_the_walk_does_neither():
    found = {name: speed_and_turn(motions.load(name)) for name in ("run", "turn", "walk")}
    assert found["run"][0] > 2.2 > found["walk"][0]
    assert found["turn"][1] > 1.2 > found["walk"][1]


def takes(*clips):
    """Takes to train on, and one of another split that is not looked at."""
    every = (*clips, travelling(9.0, 9.0))
    dataset = SimpleNamespace(garment=SimpleNamespace(name="cape"), take=lambda row: SimpleNamespace(motion=every[row]))
    return SimpleNamespace(dataset=dataset, rows=tuple(range(len(every))), sides=(*[0] * len(clips), 1))


def test_it_warns_of_what_is_missing_and_of_nothing_else():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warn_of_missing_motion(takes(travelling(3.0, 0.0), travelling(0.0, 2.0)))
    with pytest.warns(HemlineWarning, match="no take of 'cape' shows a run; got speeds of up to 1.0 m/s"):
        warn_of_missing_motion(takes(travelling(1.0, 2.0)))
    with pytest.warns(HemlineWarning, match="no take of 'cape' shows a turn; got turns of up to 57 degrees"):
        warn_of_missing_motion(takes(travelling(3.0, 1.0)))
