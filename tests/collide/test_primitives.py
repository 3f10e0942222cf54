"""Analytic distances: closed forms, Lipschitz, gradients by differences, brute force, kernels."""

import numpy as np
import pytest

from hemline.collide.primitives import distances as primitives
from hemline.collide.primitives.primitive_kernels import primitive_distance, primitive_distances, round_cone_gap
from hemline.errors import BadInput

TURN = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
A, B, C = np.array([0.1, -0.2, 0.05]), np.array([0.4, 0.3, -0.2]), np.array([0.05, 0.1, -0.1])
SHAPES = {
    "sphere": (lambda p: primitives.sphere(p, A, 0.3), primitives.round_cone_shape(A, A, 0.3, 0.3)),
    "capsule": (lambda p: primitives.capsule(p, A, B, 0.2), primitives.round_cone_shape(A, B, 0.2, 0.2)),
    "rounded cone": (lambda p: primitives.round_cone(p, A, B, 0.3, 0.1), primitives.round_cone_shape(A, B, 0.3, 0.1)),
    "swallowed cone": (
        lambda p: primitives.round_cone(p, A, B, 0.05, 0.9),
        primitives.round_cone_shape(A, B, 0.05, 0.9),
    ),
    "ellipsoid": (
        lambda p: primitives.ellipsoid(p, C, np.array([0.1, 0.4, 0.25]), TURN),
        primitives.ellipsoid_shape(C, np.array([0.1, 0.4, 0.25]), TURN),
    ),
    "box": (
        lambda p: primitives.box(p, C, np.array([0.1, 0.4, 0.25]), TURN, 0.02),
        primitives.box_shape(C, np.array([0.1, 0.4, 0.25]), TURN, 0.02),
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
    distance, (kind, shape) = SHAPES[name]
    values, gradients = distance(points)
    found, slopes = np.empty(len(points)), np.empty_like(points)
    primitive_distances(kind, shape[None], 0, points, found, slopes)
    np.testing.assert_allclose(found, values, atol=2e-12)
    np.testing.assert_allclose(slopes, gradients, atol=1e-7)
    if kind == 0:
        gaps = [round_cone_gap(shape[None], 0, *point) for point in points[:500]]
        np.testing.assert_allclose(gaps, values[:500], atol=1e-12)


def test_the_ellipsoid_is_as_far_as_its_nearest_sampled_point():
    rng = np.random.default_rng(4)
    radii = np.array([0.1, 0.4, 0.25])
    directions = rng.normal(size=(400_000, 3))
    surface = radii * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    points = rng.uniform(-0.5, 0.5, (40, 3))
    near = np.linalg.norm(surface[None] - points[:, None], axis=2).min(1)
    values, _ = primitives.ellipsoid(points, np.zeros(3), radii, np.eye(3))
    assert ((values < 0) == (((points / radii) ** 2).sum(1) < 1)).all()
    np.testing.assert_allclose(np.abs(values), near, atol=3e-3)
    assert (np.abs(values) <= near + 1e-12).all()


def test_a_cone_is_the_union_of_its_spheres():
    points = np.random.default_rng(6).uniform(-0.8, 0.8, (300, 3))
    share = np.linspace(0, 1, 4001)
    centres, radii = A + share[:, None] * (B - A), 0.3 + share * (0.1 - 0.3)
    union = (np.linalg.norm(points[:, None] - centres, axis=2) - radii).min(1)
    np.testing.assert_allclose(primitives.round_cone(points, A, B, 0.3, 0.1)[0], union, atol=1e-6)


@pytest.mark.parametrize("name", SHAPES)
def test_centres_and_axes_are_finite(name):
    _, (kind, shape) = SHAPES[name]
    for point in (shape[:3], (shape[:3] + shape[3:6]) / 2, np.zeros(3)):
        assert np.isfinite(primitive_distance(kind, shape[None], 0, *point)).all()


def test_radii_must_be_positive():
    with pytest.raises(BadInput, match="positive radii"):
        primitives.round_cone_shape(A, B, 0.1, 0.0)
    with pytest.raises(BadInput, match="positive radii"):
        primitives.ellipsoid_shape(A, np.array([0.1, -0.1, 0.1]), np.eye(3))
    with pytest.raises(BadInput, match="positive radii"):
        primitives.box_shape(A, np.array([0.1, 0.0, 0.1]), np.eye(3))
