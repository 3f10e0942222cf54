"""Strains of edges: of triangles against their flat cut, and of edges against given lengths."""

import numpy as np

from hemline.meshes import edge_lengths, edge_strains, edges, strains
from tests.meshes.mesh_samples import grid


def cut_of(vertices, faces):
    """The flat triangles of a mesh in the plane z = 0."""
    corner = vertices[faces].astype(np.float64)[:, :, :2]
    return np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)


def test_both_ways_say_the_same_of_a_crumpled_grid():
    vertices, faces = grid(4, 5)
    moved = vertices + 0.1 * np.random.default_rng(0).normal(size=vertices.shape)
    by_face = edge_strains(moved, faces, cut_of(vertices, faces))
    pairs = edges(faces)
    rest = np.linalg.norm(vertices[pairs[:, 1]] - vertices[pairs[:, 0]], axis=1)
    by_edge = {tuple(pair): strain for pair, strain in zip(pairs.tolist(), strains(moved, pairs, rest), strict=True)}
    for face, three in zip(faces.tolist(), by_face, strict=True):
        for corner in range(3):
            pair = tuple(sorted((face[corner], face[(corner + 1) % 3])))
            np.testing.assert_allclose(three[corner], by_edge[pair], atol=1e-12)


def test_a_uniform_stretch_is_its_strain_in_every_frame():
    vertices, faces = grid(4, 5)
    frames = np.stack([vertices, 1.1 * vertices, 0.5 * vertices])
    expected = np.broadcast_to(np.array([0, 0.1, -0.5])[:, None, None], (3, len(faces), 3))
    np.testing.assert_allclose(edge_strains(frames, faces, cut_of(vertices, faces)), expected, atol=1e-12)


def test_the_precision_is_that_of_what_is_given():
    vertices, faces = grid(4, 5)
    pairs = edges(faces)
    lengths = np.linalg.norm(vertices[pairs[:, 1]] - vertices[pairs[:, 0]], axis=1).astype(np.float32)
    assert strains(vertices.astype(np.float32), pairs, lengths).dtype == np.float32
    assert edge_strains(vertices.astype(np.float32), faces, cut_of(vertices, faces)).dtype == np.float64


def test_lengths_of_a_right_triangle():
    np.testing.assert_allclose(edge_lengths(np.array([[[3.0, 0.0], [0.0, 4.0]]])), [[3, 5, 4]])
