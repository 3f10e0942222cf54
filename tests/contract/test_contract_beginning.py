"""The first second of a garment that a network moves: simulated, handed over without a jump, then remembered."""

import math

import numpy as np
import pytest

import hemline
from hemline import bodies
from hemline.animators.coarse.beginning import FADE_SECONDS, Beginning
from hemline.animators.coarse.displacement import (
    PERSISTENT_FRACTION,
    PERSISTENT_SECONDS,
    SMOOTHING_SECONDS,
    TRANSIENT_SECONDS,
    Displacement,
)
from hemline.animators.coarse.features.columns import DYNAMIC
from hemline.animators.coarse.wearable import CoarseWearable
from hemline.animators.newton_solver import newton_settings
from hemline.animators.simulated_proxy import SimulatedProxy
from hemline.errors import BadInput
from tests.contract.made_models import lag_weights, small_cape

DT = 1 / 30
SIMULATED = 6
"""Frames of the garment below."""


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def motion(body):
    return body.placed(hemline.motions.load("run"))


def worn(body, seconds):
    return CoarseWearable(lag_weights()).with_simulated_start(seconds).animator_for(small_cape(), body)


@pytest.fixture(scope="module")
def frames(body, motion):
    animator, found = worn(body, SIMULATED * DT), []
    state = animator.start(body.posed(motion[0]))
    for frame in range(1, 40):
        state, vertices = animator.step(state, body.posed(motion[frame]), DT)
        found.append((state, vertices))
    return animator, found


def test_it_is_what_the_offline_simulator_makes_of_its_proxy(frames, body, motion):
    animator, found = frames
    proxy = SimulatedProxy(animator.coarse[0], body, newton_settings(), animator.rest.astype(np.float64))
    state = proxy.start(body.posed(motion[0]))
    for frame in range(1, SIMULATED):
        state = proxy.step(state, body.posed(motion[frame]), DT)
        np.testing.assert_array_equal(found[frame - 1][0].opening.simulated.positions, state.positions)
    assert all(each.opening is None for each, _ in found[SIMULATED - 1 :])


def test_it_is_over_after_its_time_however_that_is_cut(body, motion):
    for rate in (20, 30, 144):
        animator, steps = worn(body, 0.2), 0
        state = animator.start(body.posed(motion[0]))
        while state.opening is not None:
            state, _ = animator.step(state, body.posed(motion.at((steps + 1) / rate)), 1 / rate)
            steps += 1
        assert steps == math.ceil(0.2 * rate - 1e-9)


def test_hands_over_without_a_jump_and_the_error_of_the_network_fades(frames):
    _, found = frames
    handed = found[SIMULATED - 1][0]
    times = DT * np.arange(len(found) - SIMULATED + 1)
    sizes, persistent = (
        np.array(
            [np.linalg.norm(getattr(state.displacement, part), axis=1).mean() for state, _ in found[SIMULATED - 1 :]]
        )
        for part in ("transient", "persistent")
    )
    assert sizes[0] > 1e-3, "the network does not know what the simulation makes"
    assert persistent[0] > sizes[0] / 4, "cloth that has slid stays so"
    np.testing.assert_allclose(sizes, sizes[0] * np.exp(-times / TRANSIENT_SECONDS), rtol=1e-3)
    np.testing.assert_allclose(persistent, persistent[0] * np.exp(-times / PERSISTENT_SECONDS), rtol=1e-3)
    steps = np.linalg.norm(np.diff([vertices for _, vertices in found], axis=0), axis=2).mean(axis=1)
    assert steps[SIMULATED - 1] < 1.5 * np.median(steps) + sizes[0] / 4
    assert handed.trail.beginning.seconds == 0


def test_a_part_of_the_error_of_the_network_persists():
    lay, said = np.ones((3, 3), np.float32), np.zeros((3, 3), np.float32)
    displaced = Displacement.after_simulation(lay, said)
    np.testing.assert_allclose(
        displaced.transient + displaced.persistent, lay - said, rtol=1e-6
    )  # it begins without a jump
    for _ in range(30):
        displaced = displaced.advance(said, 2 * TRANSIENT_SECONDS)
    np.testing.assert_allclose(
        displaced.current, PERSISTENT_FRACTION * math.exp(-60 * TRANSIENT_SECONDS / PERSISTENT_SECONDS), atol=1e-3
    )


@pytest.mark.parametrize("dt", [1 / 144, 1 / 30])
def test_vertices_follow_a_step_of_the_network_by_an_exponential_whatever_the_time_step(dt):
    displaced, said = Displacement(np.zeros((4, 3), np.float32)), np.ones((4, 3), np.float32)
    for step in range(1, 8):
        displaced = displaced.advance(said, dt)
        np.testing.assert_allclose(displaced.current, 1 - math.exp(-step * dt / SMOOTHING_SECONDS), rtol=1e-5)


def test_the_beginning_is_a_feature_in_rotated_frames_and_fades(frames, body):
    animator, found = frames
    state = found[SIMULATED - 1][0]
    proxy = animator._on(body).proxy
    features = state.trail.features(proxy, body.posed(state.pose))[:, DYNAMIC["beginning"]]
    np.testing.assert_allclose(
        state.trail.add_displacements(features[:, :3]),
        state.trail.add_displacements(state.trail.beginning.offsets),
    )
    assert (features[:, 3] == 1).all()
    lay = Beginning(np.ones((2, 3), np.float32)).later(FADE_SECONDS).later(FADE_SECONDS)
    np.testing.assert_allclose(lay.features(), np.full((2, 4), math.exp(-2)), rtol=1e-6)


def test_without_it_the_features_are_zero_and_it_begins_at_once(body, motion):
    animator = worn(body, 0.0)
    state = animator.start(body.posed(motion[0]))
    assert state.opening is None and state.trail.beginning is None
    state, _ = animator.step(state, body.posed(motion[1]), DT)
    assert state.displacement.transient is None
    assert (state.trail.features(animator._on(body).proxy, body.posed(motion[1]))[:, DYNAMIC["beginning"]] == 0).all()


def test_a_negative_time_is_refused():
    with pytest.raises(BadInput, match=r"option 'beginning' must not be negative; got -1.0"):
        CoarseWearable(lag_weights()).with_simulated_start(-1.0)
