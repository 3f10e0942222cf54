"""The linear map that a network begins as."""

import numpy as np
import pytest

from hemline.animators.ropes.linear_start import as_network, ridge


def test_without_noise_it_is_least_squares():
    random = np.random.default_rng(0)
    x, true = random.normal(size=(200, 12)), random.normal(size=(5, 12))
    y = x @ true.T + 3
    matrix, offset = ridge(x, y, np.full(12, 1e-9))
    np.testing.assert_allclose(matrix, true, atol=1e-9)
    np.testing.assert_allclose(offset, 3, atol=1e-9)


def test_with_noise_it_is_the_best_map_for_noisy_inputs():
    random = np.random.default_rng(1)
    x, y = random.normal(size=(400, 6)), random.normal(size=(400, 3))
    y += x[:, :3]
    sigma = np.linspace(0.1, 0.8, 6)
    matrix, offset = ridge(x, y, sigma)
    # the same by brute force: every input many times with drawn noise, ordinary least squares
    many = np.concatenate([x + sigma * random.normal(size=x.shape) for _ in range(300)])
    design = np.column_stack([many, np.ones(len(many))])
    fitted = np.linalg.lstsq(design, np.tile(y, (300, 1)), rcond=None)[0]
    np.testing.assert_allclose(matrix, fitted[:-1].T, atol=0.015)
    np.testing.assert_allclose(offset, fitted[-1], atol=0.015)


def test_weights_count_frames_as_if_they_were_there_more_often():
    random = np.random.default_rng(4)
    x, y = random.normal(size=(50, 4)), random.normal(size=(50, 2))
    times = random.integers(1, 4, 50)
    weighed = ridge(x, y, np.full(4, 0.3), times.astype(float))
    repeated = ridge(np.repeat(x, times, axis=0), np.repeat(y, times, axis=0), np.full(4, 0.3))
    for one, other in zip(weighed, repeated, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-10)


def rectified(layers, x: np.ndarray) -> np.ndarray:
    for i, (weights, biases) in enumerate(layers):
        x = x @ weights.T + biases
        x = np.maximum(x, 0) if i < 2 else x
    return x


def drawn(random, ins: int, hidden: int, outs: int) -> list[tuple[np.ndarray, np.ndarray]]:
    sizes = ((hidden, ins), (hidden, hidden), (outs, hidden))
    return [(random.normal(size=size), random.normal(size=size[0])) for size in sizes]


@pytest.mark.parametrize(("ins", "hidden", "outs"), [(30, 50, 20), (8, 50, 20), (30, 41, 3)])
def test_a_rectified_network_computes_it_exactly(ins, hidden, outs):
    random = np.random.default_rng(2)
    layers = drawn(random, ins, hidden, outs)
    matrix, offset = random.normal(size=(outs, ins)), random.normal(size=outs)
    as_network(matrix, offset, layers)
    x = random.normal(size=(40, ins))
    np.testing.assert_allclose(rectified(layers, x), x @ matrix.T + offset, atol=1e-10)


def test_of_a_map_of_too_high_rank_the_largest_part_is_taken():
    random = np.random.default_rng(3)
    layers = drawn(random, 30, 10, 20)
    matrix = random.normal(size=(20, 30))
    as_network(matrix, np.zeros(20), layers)
    left, sizes, right = np.linalg.svd(matrix, full_matrices=False)
    x = random.normal(size=(40, 30))
    np.testing.assert_allclose(rectified(layers, x), x @ ((left[:, :5] * sizes[:5]) @ right[:5]).T, atol=1e-10)
