"""Neighbours of an anchor, the slope of an error over distance, and the garment at the anchor itself."""

from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.garments import coarser_garment
from hemline.motions.quaternions import inverse, multiply, to_axis_angle
from hemline.sim import settle
from hemline.sim.rest.settle import rest_state
from papers.agentdress.separability import SLOPE_DISTANCES, slope_of
from papers.agentdress.settled.neighbours import SettleFromAnchor, random_directions, step_from


@cache
def rest():
    garment, _ = coarser_garment(garments.load("tshirt-light"), 0.2)
    return settle(garment, bodies.load("anny24").shaped(), start=rest_state(garment, bodies.load("anny24").shaped()))


def test_neighbours_lie_at_the_given_distance():
    pose = rest().pose
    for step in 0.5 * random_directions(5, seed=1):
        there, betas = step_from(pose, step)
        turns = to_axis_angle(multiply(inverse(pose.rotations.astype(np.float64)), there.rotations.astype(np.float64)))
        numbers = np.concatenate([turns.ravel(), betas])
        assert np.linalg.norm(numbers) == pytest.approx(0.5, abs=1e-5)
        np.testing.assert_allclose(numbers, step, atol=1e-5)


def test_directions_prefer_no_number():
    found = random_directions(4000, seed=0)
    np.testing.assert_allclose((found**2).mean(axis=0), 1 / found.shape[1], rtol=0.15)
    np.testing.assert_allclose(found.mean(axis=0), 0.0, atol=0.01)


@pytest.mark.parametrize("power", [1.0, 1.5, 2.0])
def test_the_slope_is_the_exponent(power):
    assert slope_of({r: 3.0 * r**power for r in SLOPE_DISTANCES}) == pytest.approx(power)


def test_a_floor_hides_the_slope_until_it_is_subtracted():
    errors = {r: float(np.hypot(3.0 * r**2, 0.2)) for r in SLOPE_DISTANCES}
    assert slope_of(errors) < 1.8
    assert slope_of(errors, 0.2) == pytest.approx(2.0)
    assert np.isnan(slope_of(errors, 1.0))


def test_a_garment_at_the_anchor_stays_and_is_simulated_once(tmp_path):
    start = SettleFromAnchor(tmp_path / "near", rest())
    found = start.at((rest().pose, ()))
    np.testing.assert_array_equal(found, rest().vertices)
    (file,) = (tmp_path / "near" / "takes").iterdir()
    made = file.stat().st_mtime_ns
    np.testing.assert_array_equal(start.at((rest().pose, ())), found)
    assert file.stat().st_mtime_ns == made


def test_a_garment_follows_the_body(tmp_path):
    start, step = SettleFromAnchor(tmp_path / "near", rest()), 0.01 * random_directions(1, seed=0)[0]
    found = start.at(step_from(rest().pose, step))
    apart = np.linalg.norm(found - rest().vertices, axis=1)
    assert 1e-5 < apart.mean() < 5e-3
