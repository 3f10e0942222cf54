"""Analytic distances: closed forms, Lipschitz, gradients by differences, brute force, kernels."""

import numpy as np
import pytest

from hemline.collide.primitives import distances as primitives
from hemline.collide.primitives.primitive_kernels import round_cone_distance, round_cone_distances
from hemline.errors import BadInput

A, B = np.array([0.1, -0.2, 0.05]), np.array([0.4, 0.3, -0.2])
SHAPES = {
    "sphere": (lambda p: primitives.sphere(p, A, 0.3), primitives.round_cone_shape(A, A, 0.3, 0.3)),
    "capsule": (lambda p: primitives.capsule(p, A, B, 0.2), primitives.round_cone_shape(A, B, 0.2, 0.2)),
    "rounded cone": (lambda p: primitives.round_cone(p, A, B, 0.3, 0.1), primitives.round_cone_shape(A, B, 0.3, 0.1)),
    "swallowed cone": (
        lambda p: primitives.round_cone(p, A, B, 0.05, 0.9),
        primitives.round_cone_shape(A, B, 0.05, 0.9),
    ),
}


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(-0.8, 0.8, (4000, 3))


@pytest.mark.parametrize("name", SHAPES)
def test_distances_are_lipschitz_with_their_gradient_as_slope(name, points):
    distance = SHAPES[name][0]
    values, gradients = distance(points)
    steps = np.random.default_rng(2).normal(0, 0.2, points.shape)
    assert (np.abs(distance(points + steps)[0] - values) <= np.linalg.norm(steps, axis=1) + 1e-12).all()
    np.testing.assert_allclose(np.linalg.norm(gradients, axis=1), 1, atol=1e-9)
    h = 1e-6
    slopes = np.stack([(distance(points + h * e)[0] - distance(points - h * e)[0]) / (2 * h) for e in np.eye(3)], 1)
    # at the medial axis the slope jumps; there are no random points exactly on it, but a few within h
    assert (np.abs(slopes - gradients).max(1) < 1e-4).mean() > 0.998


@pytest.mark.parametrize("name", SHAPES)
def test_a_step_along_the_gradient_ends_on_the_surface(name, points):
    distance = SHAPES[name][0]
    values, gradients = distance(points)
    np.testing.assert_allclose(distance(points - values[:, None] * gradients)[0], 0, atol=1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_kernels_equal_numpy(name, points):
    distance, (_, shape) = SHAPES[name]
    values, gradients = distance(points)
    found, slopes = np.empty(len(points)), np.empty_like(points)
    round_cone_distances(shape[None], 0, points, found, slopes)
    np.testing.assert_allclose(found, values, atol=2e-12)
    np.testing.assert_allclose(slopes, gradients, atol=1e-7)


def test_a_cone_is_the_union_of_its_spheres():
    points = np.random.default_rng(6).uniform(-0.8, 0.8, (300, 3))
    share = np.linspace(0, 1, 4001)
    centres, radii = A + share[:, None] * (B - A), 0.3 + share * (0.1 - 0.3)
    union = (np.linalg.norm(points[:, None] - centres, axis=2) - radii).min(1)
    np.testing.assert_allclose(primitives.round_cone(points, A, B, 0.3, 0.1)[0], union, atol=1e-6)


@pytest.mark.parametrize("name", SHAPES)
def test_centres_and_axes_are_finite(name):
    _, (_, shape) = SHAPES[name]
    for point in (shape[:3], (shape[:3] + shape[3:6]) / 2, np.zeros(3)):
        assert np.isfinite(round_cone_distance(shape[None], 0, *point)).all()


def test_radii_must_be_positive():
    with pytest.raises(BadInput, match="positive radii"):
        primitives.round_cone_shape(A, B, 0.1, 0.0)
