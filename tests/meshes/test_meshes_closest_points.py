"""Nearest points: exact, with libigl as the judge, and a plain search over all triangles as the twin."""

import igl
import numpy as np
import pytest

from hemline.errors import BadMesh
from hemline.meshes import ClosestTree, closest_points_on_mesh
from hemline.meshes.closest_kernels import order_by_halves
from tests.meshes.mesh_samples import grid, sphere


def plain_closest(point, vertices, faces):
    """Distance to each triangle by trying inside, edges and corners; the smallest."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    best = np.full(len(faces), np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        share = np.clip(((point - start) * (end - start)).sum(1) / ((end - start) ** 2).sum(1), 0, 1)
        best = np.minimum(best, np.linalg.norm(start + share[:, None] * (end - start) - point, axis=1))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    foot = point - ((point - a) * normal).sum(1, keepdims=True) * normal
    sides = [(np.cross(end - start, foot - start) * normal).sum(1) for start, end in ((a, b), (b, c), (c, a))]
    inside = np.min(sides, axis=0) >= 0
    return np.where(inside, np.linalg.norm(foot - point, axis=1), best).min()


@pytest.mark.parametrize("mesh", [grid(7, 9, jitter=0.3), sphere(2), (np.eye(3), np.array([[0, 1, 2]], np.int32))])
def test_equals_libigl_and_the_plain_twin(mesh):
    vertices, faces = mesh
    points = np.random.default_rng(1).normal(size=(400, 3)) * 0.8 + vertices.mean(axis=0)
    found = closest_points_on_mesh(points, vertices, faces)
    squared, _, nearest = igl.point_mesh_squared_distance(points, vertices, faces.astype(np.int64))
    np.testing.assert_allclose(found.distances, np.sqrt(squared), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found.positions - points, axis=1), found.distances, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(nearest - points, axis=1), found.distances, atol=1e-9)
    twin = [plain_closest(point, vertices, faces) for point in points[:60]]
    np.testing.assert_allclose(found.distances[:60], twin, atol=1e-12)


def test_weights_name_the_position():
    vertices, faces = sphere(2)
    points = np.random.default_rng(2).normal(size=(200, 3))
    found = closest_points_on_mesh(points, vertices, faces)
    np.testing.assert_allclose(found.weights.sum(axis=1), 1, atol=1e-12)
    assert found.weights.min() >= 0
    rebuilt = np.einsum("pc,pcx->px", found.weights, vertices[faces[found.faces]])
    np.testing.assert_allclose(rebuilt, found.positions, atol=1e-12)


def test_points_on_the_mesh_are_at_distance_zero():
    vertices, faces = sphere(2)
    middles = vertices[faces].mean(axis=1)
    found = closest_points_on_mesh(np.concatenate([vertices, middles]), vertices, faces)
    assert found.distances.max() < 1e-12
    assert found.faces[len(vertices) :].tolist() == list(range(len(faces)))


@pytest.mark.parametrize("shape", ["sphere", "box", "star"])
def test_sign_equals_the_winding_number_of_libigl(shape):
    import trimesh

    if shape == "box":
        box = trimesh.creation.box((1, 2, 3))
        vertices, faces = np.array(box.vertices), np.array(box.faces, np.int32)
    else:
        vertices, faces = sphere(2)
        if shape == "star":  # thin spikes: the sign by triangle normals alone would fail
            vertices = vertices * np.where(np.arange(len(vertices)) % 3 == 0, 1.6, 0.7)[:, None]
    points = np.random.default_rng(3).uniform(-1.6, 1.6, (3000, 3))
    signed = ClosestTree(vertices, faces).signed_distances(points)
    inside = np.asarray(igl.winding_number(vertices, faces.astype(np.int64), points)) > 0.5
    clear = np.abs(signed) > 1e-9
    np.testing.assert_array_equal(signed[clear] < 0, inside[clear])
    assert 0.02 < inside.mean() < 0.98


def test_signed_distance_to_a_box_is_the_closed_form():
    import trimesh

    box = trimesh.creation.box((2, 2, 2))
    points = np.random.default_rng(4).uniform(-2, 2, (500, 3))
    beyond = np.abs(points) - 1
    exact = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    found = ClosestTree(np.array(box.vertices), np.array(box.faces, np.int32)).signed_distances(points)
    np.testing.assert_allclose(found, exact, atol=1e-12)


def test_a_mesh_without_triangles_is_refused():
    """A tree without triangles would have no box to begin the search in."""
    none = np.empty((0, 3), np.int32)
    for search in (lambda: ClosestTree(np.eye(3), none), lambda: closest_points_on_mesh(np.eye(3), np.eye(3), none)):
        with pytest.raises(BadMesh, match="no nearest point; got 0 triangles"):
            search()


@pytest.mark.parametrize("count", [5, 64, 1001])
def test_each_half_of_an_order_lies_on_one_side_of_the_other(count):
    centres, leaf = np.random.default_rng(count).normal(size=(count, 3)) * (1, 3, 2), 4
    leaves = 1 << int(np.ceil(np.log2(count / leaf)))
    leaf = -(-count // leaves)
    order = order_by_halves(centres, leaf, leaves)
    assert sorted(order.tolist()) == list(range(count))
    middle = leaf * (leaves // 2)
    axis = np.ptp(centres, axis=0).argmax()
    assert centres[order[:middle], axis].max() <= centres[order[middle:], axis].min()
