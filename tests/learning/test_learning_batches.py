"""What is drawn by chance for a batch."""

import numpy as np

from hemline.learning.fit.batches import sample_vertices, with_noise


def test_noise_is_normal_and_only_where_it_is_asked_for():
    inputs = np.ones((4000, 6), np.float32)
    free = np.array([1, 0, 1, 1, 0, 1], np.float32)
    noise = with_noise(inputs, 0.3, free, np.random.default_rng(0)) - inputs
    assert noise.dtype == np.float32
    assert not noise[:, free == 0].any()
    # 16000 draws: mean and deviation are known to 1 / sqrt(16000) = 0.8 %
    assert abs(noise[:, free == 1].mean()) < 4 * 0.3 / np.sqrt(16000)
    np.testing.assert_allclose(noise[:, free == 1].std(), 0.3, rtol=0.03)


def test_vertices_are_drawn_in_order_without_repetition_with_their_rows():
    vertices, rows = sample_vertices(50, 12, np.random.default_rng(1))
    assert len(vertices) == 12 and (np.diff(vertices) > 0).all() and vertices[-1] < 50
    points = np.arange(150).reshape(50, 3)
    np.testing.assert_array_equal(points.reshape(-1)[rows].reshape(-1, 3), points[vertices])


def test_each_vertex_is_drawn_as_often_as_another():
    random = np.random.default_rng(2)
    counts = np.bincount(np.concatenate([sample_vertices(20, 5, random)[0] for _ in range(4000)]), minlength=20)
    # each in a quarter of 4000 draws, with a deviation of sqrt(4000 * 3/16) = 27
    assert np.abs(counts - 1000).max() < 5 * 27


def test_all_are_taken_where_there_are_fewer():
    vertices, rows = sample_vertices(7, 100, np.random.default_rng(3))
    np.testing.assert_array_equal(vertices, np.arange(7))
    np.testing.assert_array_equal(rows, np.arange(21))
