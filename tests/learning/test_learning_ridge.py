"""Ridge regression: least squares, noise, weights."""

import numpy as np

from hemline.learning.ridge import ridge, wide_ridge


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


def test_many_outputs_are_handled_in_parts_of_frames_and_come_out_the_same():
    random = np.random.default_rng(5)
    x, y = random.normal(size=(700, 5)).astype(np.float32), random.normal(size=(700, 9)).astype(np.float32)
    y += x[:, :1] + 2
    chosen, noise = np.flatnonzero(random.random(700) < 0.8), np.linspace(0.1, 0.5, 5)
    for one, other in zip(
        wide_ridge(x, lambda some: y[some], chosen, noise), ridge(x[chosen], y[chosen], noise), strict=True
    ):
        assert one.dtype == np.float32
        np.testing.assert_allclose(one, other, atol=2e-6)
