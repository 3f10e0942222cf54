"""Filters of a point's path: their differential equations, and the same whatever the time step."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hemline.animators.coarse.features.feature_kernels import remember
from hemline.animators.coarse.features.memory import LAGS, SWINGS, FilterStep

ROWS = len(LAGS) + 2 * len(SWINGS) + 1


def path(t):
    """Somewhere at a time; not straight."""
    return np.array([np.sin(3 * t), t * t, 0.2 * np.cos(9 * t)])


def walked(times, follow=path):
    points = np.array([follow(t) for t in times], np.float32)[:, None]
    memory = np.zeros((1, ROWS, 3), np.float32)
    for k in range(1, len(times)):
        dt = times[k] - times[k - 1]
        step, after = FilterStep.of(dt), np.empty_like(memory)
        remember(points[k - 1], points[k], np.float32(dt), step.lags, step.swings, memory, after)
        memory = after
    return memory[0]


def test_filters_are_their_differential_equations():
    times = np.arange(0, 1.2, 1 / 30)
    points = np.array([path(t) for t in times])

    def at(t):
        return np.array([np.interp(t, times, points[:, axis]) for axis in range(3)])

    def velocity(t):
        k = min(int(t * 30 + 1e-9), len(times) - 2)
        return (points[k + 1] - points[k]) * 30

    memory = walked(times, path)
    for row, tau in enumerate(LAGS):
        found = solve_ivp(
            lambda t, y, tau=tau: (at(t) - y) / tau, (0, times[-1]), points[0], rtol=1e-8, atol=1e-10, max_step=1 / 60
        ).y[:, -1]
        np.testing.assert_allclose(memory[row], found - points[-1], atol=2e-4)
    for number, (omega, zeta) in enumerate(SWINGS):

        def swing(t, y, omega=omega, zeta=zeta):
            return np.concatenate([y[3:], omega**2 * (at(t) - y[:3]) + 2 * zeta * omega * (velocity(t) - y[3:])])

        start = np.concatenate([points[0], np.zeros(3)])
        found = solve_ivp(swing, (0, times[-1]), start, rtol=1e-8, atol=1e-10, max_step=1 / 120).y[:, -1]
        np.testing.assert_allclose(memory[len(LAGS) + 2 * number], found[:3] - points[-1], atol=2e-4)
        np.testing.assert_allclose(memory[len(LAGS) + 2 * number + 1], found[3:], atol=4e-3)


@pytest.mark.parametrize("parts", [2, 5])
def test_a_straight_way_may_be_cut_into_any_steps(parts):
    def straight(t):
        return t * np.array([1.0, -2.0, 0.5])

    once = walked(np.linspace(0, 0.6, 7), straight)
    often = walked(np.linspace(0, 0.6, 6 * parts + 1), straight)
    np.testing.assert_allclose(once, often, atol=2e-5)


def test_who_stands_still_forgets():
    times = np.concatenate([np.arange(0, 0.5, 1 / 30), 0.5 + np.arange(1, 300) / 30])
    memory = walked(times, lambda t: path(min(t, 0.5)))
    assert np.abs(memory).max() < 5e-5
    assert (memory[: len(LAGS)] == 0).sum() >= 6  # not a number too small for the processor to add fast


def test_a_lag_of_steady_motion_is_velocity_times_its_time():
    memory = walked(np.arange(0, 8, 1 / 30), lambda t: np.array([1.5 * t, 0, 0]))
    for row, tau in enumerate(LAGS):
        np.testing.assert_allclose(memory[row], [-1.5 * tau, 0, 0], atol=1e-4)
    np.testing.assert_allclose(memory[len(LAGS) : -1 : 2], 0, atol=1e-4)
    np.testing.assert_allclose(memory[-1], [1.5, 0, 0], atol=1e-4)
