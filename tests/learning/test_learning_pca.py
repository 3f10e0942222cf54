"""Principal components against numpy's SVD."""

import numpy as np
import pytest

from hemline.errors import BadDataset
from hemline.learning import pca
from hemline.learning.pca import principal


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
