"""Principal components against numpy's SVD."""

import numpy as np
import pytest

from hemline.errors import BadDataset
from hemline.learning import pca
from hemline.learning.pca import principal_of_map, principal_of_rows


def test_coefficients_are_projections(monkeypatch):
    monkeypatch.setattr(pca, "ROWS_PER_STRIP", 77)  # several strips, the last one short
    frames = np.random.default_rng(0).normal(size=(80, 300)).astype(np.float32)
    found = principal_of_map(np.eye(300), np.zeros(300), frames, 6)
    np.testing.assert_allclose(found.coefficients(lambda at: frames[:, at]), frames @ found.basis.T, atol=1e-4)


def test_the_identity_gives_the_directions_of_the_inputs_in_any_order():
    random = np.random.default_rng(1)
    frames = (random.normal(size=(80, 12)) * 0.5 ** np.arange(12)) @ random.normal(size=(12, 40))
    _, values, vectors = np.linalg.svd(frames, full_matrices=False)
    for order in (np.arange(80), random.permutation(80)):
        found = principal_of_map(np.eye(40), np.zeros(40), frames[order], 8)
        # second moments square the condition: 2^-8 in amplitude is 2e-5 in them, far above rounding
        assert np.abs((found.basis * vectors[:8]).sum(axis=1)).min() > 1 - 1e-6
        np.testing.assert_allclose(found.deviations, values[:8] / np.sqrt(80), rtol=1e-5)
        np.testing.assert_allclose(found.basis @ found.basis.T, np.eye(8), atol=1e-5)


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


def test_directions_of_rows_are_singular_vectors():
    random = np.random.default_rng(3)
    rows = random.normal(size=(6, 4)) @ random.normal(size=(4, 50))
    basis, coefficients = principal_of_rows(rows, 3)
    left, sizes, right = np.linalg.svd(rows, full_matrices=False)
    np.testing.assert_allclose(np.abs(np.sum(basis * right[:3], axis=1)), 1, atol=1e-9)
    np.testing.assert_allclose(np.abs(coefficients), np.abs(left[:, :3] * sizes[:3]), atol=1e-9)
    np.testing.assert_allclose(coefficients @ basis, (left[:, :3] * sizes[:3]) @ right[:3], atol=1e-9)
    assert principal_of_rows(rows, 9)[0].shape == (4, 50)  # of four dimensions
    assert principal_of_rows(np.zeros((3, 5)), 2)[1].shape == (3, 0)
