"""Rounded weights of a kernel regression: predictions, not weights, are what stays."""

import itertools

import numpy as np
import pytest

from hemline.learning.compensated_rounding import LARGEST_DIGIT, grid, round_to_digits, round_to_half

RIDGE = 1e-3


@pytest.fixture(scope="module")
def regression():
    """Returns the kernel matrix with its ridge, its inverse, weights, and the kernel of points between the samples."""
    random = np.random.default_rng(0)
    points, others = random.normal(size=(300, 3)), random.normal(size=(200, 3))
    targets = np.sin(points @ random.normal(size=(3, 5)))
    matrix = kernel(points, points) + RIDGE * np.eye(300)
    return matrix, np.linalg.inv(matrix), np.linalg.solve(matrix, targets), kernel(others, points)


def kernel(one, other):
    return 1 / (1 + ((one[:, None] - other) ** 2).sum(axis=2) / 3)


def test_eight_bits_predict_what_the_weights_predict(regression):
    _, inverse, weights, between = regression
    packed = round_to_digits(weights, inverse)
    assert packed.digits.dtype == np.int8 and np.abs(packed.digits.astype(int)).max() <= LARGEST_DIGIT
    units = grid(packed.sizes, packed.steps)
    plain = np.rint(weights / units) * units
    error, plain_error = (np.abs(between @ (each - weights)).mean() for each in (packed.weights, plain))
    assert error < 0.03 * np.abs(between @ weights).mean()
    assert error < 0.15 * plain_error


def test_half_precision_predicts_what_the_weights_predict(regression):
    _, inverse, weights, between = regression
    rounded = round_to_half(weights, inverse)
    np.testing.assert_array_equal(rounded, rounded.astype(np.float16).astype(np.float32))
    plain = weights.astype(np.float16)
    error, plain_error = (np.abs(between @ (each - weights)).mean() for each in (rounded, plain))
    assert error < 0.15 * plain_error


def test_few_weights_come_close_to_the_best_digits_of_all(regression):
    """All neighbouring digits of four weights are tried; the one in turn is at most a few times the best norm."""
    matrix = regression[0][:4, :4]
    weights = np.linalg.solve(matrix, np.float64([[0.3], [-0.2], [0.5], [0.1]]))
    digits, sizes, steps = round_to_digits(weights, np.linalg.inv(matrix))
    units = grid(sizes, steps).astype(np.float64)

    def norm(each):
        change = (each * units - weights)[:, 0]
        return float(change @ matrix @ change)

    near = np.floor(weights / units)
    best = min(norm(near + np.float64(up)[:, None]) for up in itertools.product((-1, 0, 1, 2), repeat=4))
    assert best <= norm(digits.astype(np.float64)) <= max(4 * best, 1e-12)


def test_weights_that_can_be_stored_stay(regression):
    _, inverse, _, _ = regression
    stored = np.random.default_rng(1).normal(size=(300, 2)).astype(np.float16).astype(np.float64)
    np.testing.assert_array_equal(round_to_half(stored, inverse), stored)
    digits, sizes, steps = round_to_digits(np.zeros((300, 2)), inverse)
    assert not digits.any() and (steps > 0).all() and (sizes > 0).all()


def test_samples_of_small_weights_have_finer_steps(regression):
    _, inverse, weights, _ = regression
    packed = round_to_digits(weights * np.where(np.arange(300) % 2, 0.05, 1.0)[:, None], inverse)
    small, large = packed.sizes[1::2].astype(float).mean(), packed.sizes[::2].astype(float).mean()
    assert 0.02 < small / large < 0.15
