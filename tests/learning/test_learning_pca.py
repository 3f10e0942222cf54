"""Principal components against numpy's SVD."""

import numpy as np
import pytest

from hemline.errors import BadDataset
from hemline.learning import pca
from hemline.learning.pca import principal, principal_of_map


def made(frames=80, rows=300, rank=12, seed=0):
    random = np.random.default_rng(seed)
    scales = 0.5 ** np.arange(rank)
    return ((random.normal(size=(frames, rank)) * scales) @ random.normal(size=(rank, rows))).astype(np.float32)


def test_equals_the_svd_up_to_sign(monkeypatch):
    monkeypatch.setattr(pca, "STRIP", 77)  # several strips, the last one short
    frames = made()
    found = principal(lambda at: frames[:, at], 300, 10)
    _, values, vectors = np.linalg.svd(frames.astype(np.float64), full_matrices=False)
    cosines = np.abs((found.basis * vectors[:10]).sum(axis=1))
    # the Gram matrix squares the condition: 2^-10 in amplitude is 1e-6 in it, far above rounding
    assert cosines.min() > 1 - 1e-6
    np.testing.assert_allclose(found.deviations, values[:10] / np.sqrt(80), rtol=1e-5)
    np.testing.assert_allclose(found.explained, (values[:10] ** 2).sum() / (values**2).sum(), rtol=1e-6)
    np.testing.assert_allclose(found.basis @ found.basis.T, np.eye(10), atol=1e-5)


def test_coefficients_are_projections():
    frames = made()
    found = principal(lambda at: frames[:, at], 300, 6)
    np.testing.assert_allclose(found.coefficients(lambda at: frames[:, at]), frames @ found.basis.T, atol=1e-4)


def test_order_of_the_frames_does_not_matter():
    frames = made()
    shuffled = frames[np.random.default_rng(1).permutation(len(frames))]
    one, other = (principal(lambda at, f=f: f[:, at], 300, 6) for f in (frames, shuffled))
    # the same vectors with the same signs; float32 sums in another order differ in the last digits
    np.testing.assert_allclose(one.basis, other.basis, atol=2e-5)


def test_as_many_directions_as_the_frames_span():
    frames = made(rank=3)
    assert len(principal(lambda at: frames[:, at], 300, 100).basis) in range(3, 20)
    one = made(frames=1, rank=3)
    assert len(principal(lambda at: one[:, at], 300, 100).basis) == 1


def test_frames_at_rest_are_refused():
    still = np.zeros((5, 30), np.float32)
    with pytest.raises(BadDataset, match=r"frames that move; got 5 frames at rest; add takes"):
        principal(lambda at: still[:, at], 30, 4)
    with pytest.raises(BadDataset, match="0 frames at rest"):
        principal(lambda at: still[:0, at], 30, 4)


def test_directions_of_a_map_are_those_of_what_it_makes():
    random = np.random.default_rng(2)
    inputs = random.normal(size=(60, 7)) * 0.6 ** np.arange(7) + 0.1
    matrix, offset = random.normal(size=(200, 7)), random.normal(size=200)
    found = principal_of_map(matrix, offset, inputs, 5)
    made_of_it = inputs @ matrix.T + offset
    _, values, vectors = np.linalg.svd(made_of_it, full_matrices=False)
    cosines = np.abs((found.basis * vectors[:5]).sum(axis=1))
    assert cosines.min() > 1 - 1e-5
    np.testing.assert_allclose(found.deviations, values[:5] / np.sqrt(60), rtol=1e-5)
    np.testing.assert_allclose(found.explained, (values[:5] ** 2).sum() / (values**2).sum(), rtol=1e-6)
    assert (found.basis[np.arange(5), np.abs(found.basis).argmax(axis=1)] > 0).all()
    # no more directions come back than the map has
    assert len(principal_of_map(matrix[:, :2], 0 * offset, inputs[:, :2], 5).basis) == 2


def test_a_map_to_nothing_has_no_directions():
    with pytest.raises(BadDataset, match="principal components need frames that move; got a map to zero"):
        principal_of_map(np.zeros((6, 2)), np.zeros(6), np.ones((4, 2)), 3)
