"""Wind: its statistics, a plain NumPy version, and functions that users give."""

import numpy as np
import pytest

from hemline.errors import BadInput
from hemline.sim import Gusts, SimSettings, Stepper
from hemline.sim.cloth.wind import wind_of
from hemline.sim.cloth.wind_kernels import cosine_of_turns

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops


def test_the_cosine_is_numpys():
    turns = np.concatenate([np.linspace(-3, 3, 2001), [1e3, -1e3 - 0.25]])
    assert max(abs(cosine_of_turns(t) - np.cos(2 * np.pi * t)) for t in turns) < 2e-7


def test_gusts_equal_those_of_the_plain_reference():
    gusts, x = (
        Gusts(mean=(1.0, 0.0, -2.0), strength=0.7, length=1.5, seconds=0.8, seed=4),
        np.random.default_rng(0).normal(size=(50, 3)),
    )
    wave, turn, phase, amplitude = gusts._waves
    angle = (x - 1.3 * np.array(gusts.mean)) @ wave.T + 1.3 * turn + phase
    assert np.allclose(gusts(1.3, x), np.array(gusts.mean) + np.cos(angle) @ amplitude, atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_gusts_have_their_mean_and_their_strength_in_each_direction(seed):
    # over all of time and space, so over places and times far beyond length and time; 20,000 draws of a sum of 36
    # waves leave about 1.5 % of the deviation
    gusts = Gusts(mean=(3.0, 0.0, 1.0), strength=0.8, length=0.5, seconds=0.3, seed=seed)
    random = np.random.default_rng(100 + seed)
    drawn = np.concatenate([gusts(1e4 * random.uniform(), 1e3 * random.normal(size=(10, 3))) for _ in range(2000)])
    assert np.abs(drawn.mean(axis=0) - gusts.mean).max() < 0.03 * gusts.strength
    assert drawn.std(axis=0) == pytest.approx(gusts.strength, rel=0.03)


def test_places_and_times_correlate_as_said():
    length, time = 0.8, 0.5
    here, near = np.zeros((1, 3)), np.array([[0.6, 0.3, -0.2]])
    found = {"place": [], "time": [], "carried": []}
    for seed in range(1500):
        gusts = Gusts(mean=(2.0, 0.0, 0.0), length=length, seconds=time, seed=seed)
        start = gusts(0.0, here) - gusts.mean
        found["place"].append((start * (gusts(0.0, near) - gusts.mean)).mean())
        found["carried"].append((start * (gusts(0.3, here + [0.6, 0, 0]) - gusts.mean)).mean())
        found["time"].append((start * (gusts(0.3, here) - gusts.mean)).mean())
    distance = np.linalg.norm(near)
    # 1,500 seeds, three components: about 2 % of the variance
    assert np.mean(found["place"]) == pytest.approx(np.exp(-(distance**2) / (2 * length**2)), abs=0.06)
    assert np.mean(found["carried"]) == pytest.approx(np.exp(-(0.3**2) / (2 * time**2)), abs=0.06)
    swept = np.exp(-(0.3**2) / (2 * time**2) - (2.0 * 0.3) ** 2 / (2 * length**2))
    assert np.mean(found["time"]) == pytest.approx(swept, abs=0.06)


def test_gusts_do_not_compress_the_air():
    gusts, x, step = Gusts(seed=3), np.random.default_rng(0).normal(size=(20, 3)), 1e-5
    slopes = [(gusts(2.0, x + step * e) - gusts(2.0, x - step * e)) / (2 * step) for e in np.eye(3)]
    divergence = sum(slope[:, axis] for axis, slope in enumerate(slopes))
    assert np.abs(divergence).max() < 1e-6 < 0.1 < max(np.abs(slope).max() for slope in slopes)


def test_the_seed_decides():
    x = np.random.default_rng(1).normal(size=(5, 3))
    assert np.array_equal(Gusts(seed=2)(1.0, x), Gusts(seed=2)(1.0, x))
    assert not np.allclose(Gusts(seed=2)(1.0, x), Gusts(seed=3)(1.0, x))


def test_settings_declare_constant_wind_or_gusts():
    x = np.zeros((2, 3))
    assert wind_of(SimSettings(wind=(1.0, 2.0, 3.0)))(0.0, x).tolist() == [[1.0, 2.0, 3.0]] * 2
    settings = SimSettings(wind=(1.0, 0.0, 0.0), gusts=0.5, gust_length=3.0, gust_seconds=2.0, gust_seed=7)
    assert wind_of(settings) == Gusts((1.0, 0.0, 0.0), 0.5, 3.0, 2.0, 7)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"gusts": -1.0}, "'gusts' must not be negative; got -1.0"),
        ({"gusts": np.nan}, "'gusts' must not be negative; got nan"),
        ({"gust_length": 0.0}, "'gust_length' must be positive"),
        ({"gust_seconds": np.inf}, "'gust_seconds' must be positive"),
        ({"gust_seed": -1}, "'gust_seed' must not be negative; got -1; give a whole number"),
        ({"gust_seed": 0.5}, "'gust_seed' must be a whole number"),
    ],
)
def test_gusts_that_make_no_sense_are_refused(setting, message):
    with pytest.raises(BadInput, match=message):
        SimSettings(**setting)


def holed(seconds, positions):
    velocity = np.zeros_like(positions)
    if seconds > 0.015:
        velocity[[3, 7], 1] = np.nan, np.inf
    return velocity


@pytest.mark.parametrize(
    ("wind", "message"),
    [
        (
            holed,
            "wind must be finite; got NaN or infinity at 0.02 s for 2 of 25 vertices, the first 3; check the func",
        ),
        (lambda t, x: np.zeros((3, 3)), r"wind must give 25 velocities; got shape \(3, 3\) at 0 s; return one"),
        (lambda t, x: np.zeros(3), r"wind must give 25 velocities; got shape \(3,\) at 0 s"),
        (lambda t, x: "north", "wind must give velocities; got str at 0 s; return an array of numbers"),
        (lambda t, x: None, "wind must give .* at 0 s"),
    ],
)
def test_a_users_wind_that_is_no_wind_is_refused_with_its_time(square, free, wind, message):
    sheet, x = square(5, drag=1.0)
    stepper = Stepper(sheet, wind=wind)
    state = stepper.start(x)
    with pytest.raises(BadInput, match=message):
        for _ in range(4):
            state, _ = stepper.advance(state, 0.01, free)


def test_a_users_wind_cannot_move_the_cloth(square, free):
    def greedy(seconds, positions):
        positions += 1.0
        return positions

    sheet, x = square(5, drag=1.0)
    stepper = Stepper(sheet, wind=greedy)
    with pytest.raises(ValueError, match="read-only"):
        stepper.advance(stepper.start(x), 0.01, free)
