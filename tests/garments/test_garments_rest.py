"""Flat rest triangles, from meshes and from patterns."""

import numpy as np
import pytest

from hemline.garments.reading.rest_shape import rewind_rest_edges
from hemline.garments.rest_metric import rest_edges_of_mesh, rest_edges_of_pattern
from hemline.meshes import edge_lengths, edge_strains

RNG = np.random.default_rng(0)
VERTICES, FACES = RNG.normal(size=(9, 3)), np.array([[0, 1, 2], [3, 4, 5], [6, 7, 8], [0, 4, 8]], np.int32)


def test_a_mesh_laid_flat_keeps_lengths_and_areas():
    rest = rest_edges_of_mesh(VERTICES, FACES)
    np.testing.assert_allclose(edge_strains(VERTICES, FACES, rest), 0, atol=1e-12)
    corner = VERTICES[FACES]
    areas = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    np.testing.assert_allclose(np.linalg.det(rest), areas)


def test_a_stretch_is_its_strain():
    rest = rest_edges_of_mesh(VERTICES, FACES)
    np.testing.assert_allclose(edge_strains(1.1 * VERTICES, FACES, rest), 0.1)


def test_mirrored_pieces_of_a_pattern_are_mirrored_back():
    flat = RNG.normal(size=(9, 2))
    rest = rest_edges_of_pattern(flat, FACES)
    mirrored = rest_edges_of_pattern(flat * (-1, 1), FACES)
    assert (np.linalg.det(rest) > 0).all()
    np.testing.assert_allclose(edge_lengths(rest), edge_lengths(mirrored))


@pytest.mark.parametrize("turned", [[], [1], [0, 2, 3]])
def test_turned_triangles_keep_their_edges(turned):
    rest = rest_edges_of_mesh(VERTICES, FACES)
    after = FACES.copy()
    after[turned] = after[turned][:, [0, 2, 1]]
    again = rewind_rest_edges(rest, FACES, after)
    assert (np.linalg.det(again) > 0).all()
    np.testing.assert_allclose(edge_strains(VERTICES, after, again), 0, atol=1e-12)
