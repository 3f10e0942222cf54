"""Limits of edge lengths alone: what is too long is shortened, what is not stays, pins do not move."""

import numpy as np
import pytest

from hemline import garments
from hemline.collide import LengthLimits
from hemline.meshes import rest_lengths


@pytest.fixture(scope="module")
def cape():
    return garments.load("cape-light")


def lengths_over(garment, vertices, settled):
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    free = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    long, rest = (np.linalg.norm(np.subtract(*each[edges].transpose(1, 0, 2)), axis=1) for each in (vertices, settled))
    return (long / np.maximum(lengths, rest))[free]


def test_cloth_within_its_lengths_is_not_touched(cape):
    """At rest, and smaller than at rest: cloth may fold."""
    limits = LengthLimits.of(cape, cape.vertices)
    for scale in (1.0, 0.8):
        given = (scale * cape.vertices).astype(np.float32)
        np.testing.assert_array_equal(limits.hold(given), given)


def test_edges_that_are_too_long_are_shortened_to_the_limit(cape):
    random = np.random.default_rng(0)
    torn = cape.vertices + 0.004 * random.normal(size=cape.vertices.shape)
    before = lengths_over(cape, torn, cape.vertices)
    after = lengths_over(cape, LengthLimits.of(cape, cape.vertices).hold(torn), cape.vertices)
    assert np.percentile(before, 99) > 1.2
    assert np.percentile(after, 99) < 1.06
    strict = LengthLimits.of(cape, cape.vertices, stretch=1.005, sweeps=60)
    assert np.percentile(lengths_over(cape, strict.hold(torn), cape.vertices), 99) < np.percentile(after, 99)


def test_cloth_that_is_longer_at_rest_than_on_the_pattern_may_stay_so(cape):
    """A settled garment that is stretched over the body is not pulled off it."""
    wide = (cape.vertices * [1.2, 1.0, 1.0]).astype(np.float32)
    np.testing.assert_array_equal(LengthLimits.of(cape, wide).hold(wide), wide)
    assert np.abs(LengthLimits.of(cape, cape.vertices).hold(wide) - wide).max() > 0.005


def test_pins_stay_and_the_input_is_not_changed(cape):
    given = np.array(cape.vertices * 1.3, np.float32)
    kept = given.copy()
    held = LengthLimits.of(cape, cape.vertices).hold(given)
    np.testing.assert_array_equal(given, kept)
    np.testing.assert_array_equal(held[cape.pins.vertices], given[cape.pins.vertices])
    assert held.dtype == np.float32
