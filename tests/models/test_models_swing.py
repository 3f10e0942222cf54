"""The shipped cape swings as simulated cloth does: as strongly in each band, and as long after the body stops."""

import numpy as np
import pytest

import hemline
from hemline.sim import SimSettings, simulate
from papers.rope_chains.hem import frozen_figures, hem_in_key, power_by_band


@pytest.fixture(scope="module")
def cape():
    return hemline.load("cape")


@pytest.fixture(scope="module")
def body(cape):
    return hemline.bodies.load("anny24").shaped()


def test_power_of_a_sine_is_found_in_its_band():
    """Parseval: under a Hann window, a sine of amplitude a in n frames has 3 a^2 n^2 / 32, over three coordinates."""
    times, amplitude = np.arange(300) / 30, 0.2
    for band, frequency in enumerate((0.5, 1.5, 3.0, 6.0)):
        seen = np.zeros((300, 1, 3))
        seen[:, 0, 1] = amplitude * np.sin(2 * np.pi * frequency * times)
        power = power_by_band(seen, 30.0)
        assert power[band] == pytest.approx(max(power))
        assert sum(power) == pytest.approx(3 * amplitude**2 * 300**2 / 32 / 3, rel=0.02)


@pytest.mark.slow
def test_cape_swings_on_after_a_frozen_run_for_as_long_as_cloth(cape, body):
    figures = frozen_figures(cape, body)
    assert figures["frozen_decay_s"] == pytest.approx(figures["frozen_truth_decay_s"], rel=0.2)
    assert figures["frozen_swing_mm"] == pytest.approx(figures["frozen_truth_swing_mm"], rel=0.25)


@pytest.mark.slow
def test_hem_of_the_cape_has_the_power_of_cloth_on_a_dance(cape, body):
    """A rigid garment has no power, one that trembles several times that of cloth in the upper bands.

    `dance` is of a person who is not part of the fit, and is the clip with the largest error.
    """
    dance = body.placed(hemline.motions.load("dance").resample(30))
    take = simulate(cape.garment, body, dance, SimSettings(fps=30.0))
    frames = list(hemline.play(cape, body, dance, fps=None, placed=True))
    shown = np.stack([frame.vertices for frame in frames])
    ours, theirs = (
        np.array(power_by_band(hem_in_key(cape, frames, each), 30.0)) for each in (shown, take.vertices[~take.lead_in])
    )
    assert np.all((ours > 0.5 * theirs) & (ours < 1.5 * theirs))
