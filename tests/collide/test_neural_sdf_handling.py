"""Vertices out of the body along a distance: laws of Eq. 10 and of its two baselines on a sphere."""

from dataclasses import dataclass

import numpy as np
import pytest

from hemline.collide.neural_sdf.distance import Distance
from hemline.collide.neural_sdf.handling import Neighbours, push_out, push_out_by_distance, push_out_by_scale
from hemline.errors import BadMesh

RADIUS = 0.3


@dataclass(frozen=True)
class Sphere:
    """The exact distance to a sphere about the origin; its gradient is stretched, which must not matter."""

    radius: float = RADIUS
    stretch: float = 1.0

    def signed_distances(self, points):
        return np.linalg.norm(points, axis=1) - self.radius

    def with_gradients(self, points):
        return self.signed_distances(points), self.stretch * points / np.linalg.norm(points, axis=1, keepdims=True)


def sheet(sunk: float = 0.02, size: int = 15):
    """A sheet over the top of the sphere, its middle under the surface."""
    x, z = (each.reshape(-1) for each in np.meshgrid(*2 * [np.linspace(-0.15, 0.15, size)]))
    grid = np.arange(size * size).reshape(size, size)
    one, two, three, four = (grid[a, b].reshape(-1) for a in (np.s_[:-1], np.s_[1:]) for b in (np.s_[:-1], np.s_[1:]))
    faces = np.concatenate([np.stack([one, three, two], 1), np.stack([two, three, four], 1)]).astype(np.int32)
    return np.stack([x, np.full_like(x, RADIUS - sunk), z], 1), faces


def test_the_sphere_is_a_distance():
    assert isinstance(Sphere(), Distance)


@pytest.mark.parametrize("stretch", [1.0, 3.0])
def test_vertices_inside_land_at_the_radius_plus_what_free_neighbours_say(stretch):
    vertices, faces = sheet()
    found = push_out(vertices, Sphere(stretch=stretch), Neighbours.of(vertices, faces))
    signed = Sphere().signed_distances(vertices)
    inside = signed < 0
    assert 10 < inside.sum() < len(vertices) - 10
    np.testing.assert_array_equal(found.moved, inside)
    np.testing.assert_array_equal(found.vertices[~inside], vertices[~inside])
    beside = {int(i): set() for i in range(len(vertices))}
    for a, b, c in faces.tolist():
        beside[a] |= {b, c}
        beside[b] |= {a, c}
        beside[c] |= {a, b}
    deviation = np.mean([np.linalg.norm(vertices[i] - vertices[k]) for i in beside for k in beside[i]])
    deltas = []
    for i in np.flatnonzero(inside):  # by hand, one by one
        free = [k for k in beside[i] if not inside[k]]
        weights = [np.exp(-(np.linalg.norm(vertices[i] - vertices[k]) ** 2) / (2 * deviation**2)) for k in free]
        deltas.append(np.average(signed[free], weights=weights) if free else 0.0)
    landed = np.linalg.norm(found.vertices[inside], axis=1)
    np.testing.assert_allclose(landed, RADIUS + np.array(deltas), atol=1e-12)
    assert 0 in deltas and max(deltas) > 0.001
    turned = found.vertices[inside] / landed[:, None] - vertices[inside] / np.linalg.norm(
        vertices[inside], axis=1, keepdims=True
    )
    assert np.abs(turned).max() < 1e-12  # along the gradient


def test_neighbours_that_collide_are_left_out():
    vertices = np.array([[0, 0.28, 0], [0.01, 0.27, 0], [0, 0.31, 0.01]])  # two inside, one outside
    faces = np.array([[0, 1, 2]], np.int32)
    found = push_out(vertices, Sphere(), Neighbours.of(vertices, faces))
    delta = np.linalg.norm(vertices[2]) - RADIUS
    np.testing.assert_allclose(np.linalg.norm(found.vertices[:2], axis=1), RADIUS + delta, atol=1e-12)


def test_with_no_free_neighbour_it_goes_to_the_surface_and_a_free_garment_stays():
    vertices, faces = sheet(sunk=0.2)
    deep = push_out(vertices, Sphere(radius=0.5), Neighbours.of(vertices, faces))
    assert deep.moved.all()
    np.testing.assert_allclose(np.linalg.norm(deep.vertices, axis=1), 0.5, atol=1e-12)
    free = push_out(vertices, Sphere(radius=0.05), Neighbours.of(vertices, faces))
    assert not free.moved.any()
    np.testing.assert_array_equal(free.vertices, vertices)


def test_weights_of_far_neighbours_still_have_sum_one():
    vertices = np.array([[0, 0.29, 0], [3.0, 0.4, 0], [0, 0.4, 3.0], [0, 0.29, 0.001], [0.001, 0.29, 0]])
    faces = np.array([[0, 1, 2], [0, 3, 4], [0, 4, 3], [3, 4, 0], [3, 0, 4]], np.int32)
    neighbours = Neighbours(Neighbours.of(vertices, faces).pairs, 0.001)  # exp(-9 / 2e-6) is zero in float64
    found = push_out(vertices, Sphere(), neighbours)
    assert np.linalg.norm(found.vertices[0]) - RADIUS == pytest.approx(
        Sphere().signed_distances(vertices[1:3]).mean(), rel=0.01
    )


def test_the_baselines_move_by_one_length_and_by_one_share_of_the_depth():
    vertices, _ = sheet()
    inside = Sphere().signed_distances(vertices) < 0
    for found, lengths in (
        (push_out_by_distance(vertices, Sphere(), 0.03), np.full(inside.sum(), 0.03)),
        (push_out_by_scale(vertices, Sphere(), 1.2), 1.2 * -Sphere().signed_distances(vertices)[inside]),
    ):
        np.testing.assert_array_equal(found.moved, inside)
        np.testing.assert_allclose(np.linalg.norm(found.vertices - vertices, axis=1)[inside], lengths, atol=1e-12)
        assert (Sphere().signed_distances(found.vertices) > -1e-12).all()


def test_float32_stays_float32_and_the_input_is_not_changed():
    vertices, faces = sheet()
    given = vertices.astype(np.float32)
    kept = given.copy()
    found = push_out(given, Sphere(), Neighbours.of(given, faces))
    assert found.vertices.dtype == np.float32
    np.testing.assert_array_equal(given, kept)


def test_bad_garments_are_refused():
    vertices, faces = sheet()
    neighbours = Neighbours.of(vertices, faces)
    with pytest.raises(BadMesh, match="neighbours need a mesh with edges"):
        Neighbours.of(vertices, np.zeros((0, 3), np.int32))
    with pytest.raises(BadMesh, match="neighbours need a mesh with edges"):
        Neighbours.of(np.zeros_like(vertices), faces)
    with pytest.raises(BadMesh, match="neighbours of a mesh of at least 225 vertices"):
        push_out(vertices[:100], Sphere(), neighbours)
    torn = vertices.copy()
    torn[3] = np.nan
    for way in (
        lambda: push_out(torn, Sphere(), neighbours),
        lambda: push_out_by_distance(torn, Sphere(), 0.01),
        lambda: push_out_by_scale(torn, Sphere(), 1.1),
    ):
        with pytest.raises(BadMesh, match="positions must be finite"):
            way()
