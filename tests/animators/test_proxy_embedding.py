"""The fine garment carried by the coarse one: exact where it can be, its kernels against plain NumPy."""

import numpy as np
import pytest

from hemline.garments.proxy.embedding import Embedding, _frames
from hemline.garments.proxy.embedding_kernels import carry, turn_frames
from hemline.garments.proxy.proxy import ProxySize, proxy_of
from hemline.meshes import vertex_normals
from hemline.motions.quaternions import from_axis_angle, to_matrix
from tests.animators import made_coarse as made

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops


@pytest.fixture(scope="module")
def coarse():
    return proxy_of(made.skirt(), ProxySize(fewest=300, edge=0.06))


@pytest.fixture(scope="module")
def embedding(coarse):
    return Embedding.of(made.skirt(), *coarse)


def waved(points):
    """Bent and sheared: nothing that frames could follow exactly."""
    x, y, z = points.T.astype(np.float64)
    return np.stack([x + 0.03 * np.sin(9 * y), y - 0.02 * np.cos(7 * z + x), z + 0.05 * np.sin(5 * x + 4 * y)], axis=1)


@pytest.mark.parametrize(("edge", "least", "most"), [(0.035, 1300, 1500), (0.05, 600, 750), (0.2, 500, 500)])
def test_the_coarse_garment_has_a_vertex_for_each_bit_of_cloth(edge, least, most):
    coarse, kept = proxy_of(made.skirt(), ProxySize(edge=edge))
    assert least <= len(coarse.vertices) <= most
    np.testing.assert_array_equal(coarse.vertices, made.skirt().vertices[kept])
    lengths = np.linalg.norm(coarse.rest_edges, axis=1)
    if edge < 0.2:
        assert lengths.mean() == pytest.approx(edge, rel=0.15)


def test_a_garment_with_fewer_vertices_is_its_own_coarse_one():
    small, _ = proxy_of(made.skirt(), ProxySize(fewest=300, edge=0.06))
    again, kept = proxy_of(small, ProxySize())
    assert again is small
    points = waved(small.vertices)
    np.testing.assert_allclose(Embedding.of(small, again, kept).fine_vertices(points), points, atol=1e-4)


def test_a_rigid_motion_is_passed_on_exactly(coarse, embedding):
    turn, shift = to_matrix(from_axis_angle(np.array([0.4, -2.0, 1.1]))), np.array([0.3, 5.0, -1.0])
    carried = embedding.fine_vertices(coarse[0].vertices @ turn.T + shift)
    np.testing.assert_allclose(carried, made.skirt().vertices @ turn.T + shift, atol=2e-6)


def test_coarse_vertices_stay_where_they_are(coarse, embedding):
    points = waved(coarse[0].vertices)
    apart = np.linalg.norm(embedding.fine_vertices(points)[coarse[1]] - points, axis=1)
    assert apart.mean() < 1e-4


def test_a_smooth_deformation_is_followed_closely(coarse, embedding):
    carried, truth = embedding.fine_vertices(waved(coarse[0].vertices)), waved(made.skirt().vertices)
    assert np.linalg.norm(carried - truth, axis=1).mean() < 2e-3
    # the mean of the three nearest coarse vertices, for scale
    near, weights = embedding.near[:, :3], embedding.weights[:, :3]
    plain = np.einsum("vk,vki->vi", weights / weights.sum(axis=1, keepdims=True), waved(coarse[0].vertices)[near])
    assert np.linalg.norm(plain - truth, axis=1).mean() > 5e-3


def test_weights_are_shares(embedding):
    assert (embedding.weights >= 0).all()
    np.testing.assert_allclose(embedding.weights.sum(axis=1), 1)


def test_frames_are_rotations_and_the_kernels_do_what_plain_numpy_does(coarse, embedding):
    garment = coarse[0]
    points = np.ascontiguousarray(waved(garment.vertices))
    normals = vertex_normals(points, garment.faces).astype(np.float64)
    frames = np.empty((len(points), 3, 3))
    turn_frames(points, normals, embedding.start, embedding.ring, embedding.slopes, frames)
    np.testing.assert_allclose(frames, plain_frames(embedding, points, normals), atol=1e-9)
    np.testing.assert_allclose(frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.shape), atol=1e-6)
    assert (np.linalg.det(frames) > 0).all()
    vertices = np.empty((len(embedding.near), 3), np.float32)
    carry(points, frames, embedding.near, embedding.weights, embedding.offsets, vertices)
    each = points[embedding.near] + np.einsum("vkij,vkj->vki", frames[embedding.near], embedding.offsets)
    np.testing.assert_allclose(vertices, np.einsum("vk,vki->vi", embedding.weights, each), atol=1e-6)


def plain_frames(embedding, points, normals):
    """Tangents of the plane, turned by the polar part of the images seen in it."""
    owner = np.repeat(np.arange(len(points)), np.diff(embedding.start))
    images = np.zeros((len(points), 3, 2))
    np.add.at(images, owner, (points[embedding.ring] - points[owner])[:, :, None] * embedding.slopes[:, None, :])
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    plane = np.stack([first, np.cross(normals, first)], axis=2)
    left, _, right = np.linalg.svd(plane.transpose(0, 2, 1) @ images)
    left[:, :, 1] *= np.sign(np.linalg.det(left @ right))[:, None]
    return np.concatenate([plane @ left @ right, normals[:, :, None]], axis=2)


def test_at_rest_the_frames_are_those_at_rest(coarse, embedding):
    rest, faces = coarse[0].vertices.astype(np.float64), coarse[0].faces
    normals, frames = vertex_normals(rest, faces).astype(np.float64), np.empty((len(rest), 3, 3))
    turn_frames(rest, normals, embedding.start, embedding.ring, embedding.slopes, frames)
    np.testing.assert_allclose(frames, _frames(rest, faces), atol=1e-6)


def test_cloth_is_not_carried_by_what_is_near_through_the_air_only():
    """Two sheets, a millimetre apart: each is carried by itself."""
    fine, coarse, kept = made.two_sheets()
    half = len(fine.vertices) // 2
    carriers = kept[Embedding.of(fine, coarse, kept).near]
    assert (carriers[:half] < half).all() and (carriers[half:] >= half).all()
