"""The linear map that a network begins as."""

import numpy as np
import pytest

from hemline.learning.fit.linear_start import as_network


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
