"""Ways along a surface against closed forms and libigl's exact geodesics."""

import igl
import numpy as np
import pytest

from hemline.errors import BadMesh
from hemline.meshes import geodesic_distances
from tests.meshes.mesh_samples import grid, sphere


def test_from_a_side_of_a_sheet_it_is_the_height():
    vertices, faces = grid(40, 30, jitter=0.25)
    rim = np.flatnonzero(vertices[:, 1] == 0)
    found = geodesic_distances(vertices, faces, rim)
    np.testing.assert_allclose(found, vertices[:, 1], atol=0.002)


def test_from_a_point_of_a_sheet_it_is_the_straight_line():
    vertices, faces = grid(40, 40, jitter=0.25)
    source = 40 * 13 + 17
    exact = np.linalg.norm(vertices - vertices[source], axis=1)
    far = exact > 0.1
    error = np.abs(geodesic_distances(vertices, faces, np.array([source])) - exact)[far] / exact[far]
    assert error.mean() < 0.003 and error.max() < 0.02


def test_on_a_sphere_it_is_the_angle():
    vertices, faces = sphere(4)
    angle = np.arccos(np.clip(vertices @ vertices[0], -1, 1))
    found = geodesic_distances(vertices, faces, np.array([0]))
    assert np.abs(found - angle)[angle > 0.2].max() < 0.02 * np.pi
    assert (np.abs(found - angle) / np.maximum(angle, 0.2)).mean() < 0.01


def test_equals_the_exact_geodesics_of_libigl_on_a_bent_strip():
    vertices, faces = grid(41, 25, width=0.6, jitter=0.2)
    bent = np.stack([np.sin(4 * vertices[:, 0]) / 4, vertices[:, 1], np.cos(4 * vertices[:, 0]) / 4], axis=1)
    none = np.empty(0, np.int64)
    exact = np.asarray(
        igl.exact_geodesic(bent, faces.astype(np.int64), np.array([300]), none, np.arange(len(bent)), none)
    )
    found = geodesic_distances(bent, faces, np.array([300]))
    far = exact > 0.05
    assert (np.abs(found - exact)[far] / exact[far]).mean() < 0.004


def test_a_hole_is_walked_around():
    vertices, faces = grid(41, 41)
    middle = vertices[faces].mean(axis=1)
    slit = (np.abs(middle[:, 1] - 0.5) < 0.03) & (middle[:, 0] < 0.7)
    start, end = 5, 40 * 41 + 5
    found = geodesic_distances(vertices, faces[~slit], np.array([start]))[end]
    # around the tip of the slit, whose half height is one cell
    corner_low, corner_high = np.array([0.7, 0.475]), np.array([0.7, 0.525])
    exact = np.linalg.norm(corner_low - vertices[start, :2]) + 0.05 + np.linalg.norm(vertices[end, :2] - corner_high)
    assert found == pytest.approx(exact, rel=0.015)
    assert found > 1.5 * np.linalg.norm(vertices[end] - vertices[start])


def test_the_rest_metric_takes_the_place_of_positions():
    vertices, faces = grid(20, 20)
    crumpled = vertices * (1, 0.3, 1) + np.random.default_rng(0).normal(scale=0.01, size=vertices.shape)
    corner = vertices[faces][:, :, :2]
    rest = np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)
    rim = np.flatnonzero(vertices[:, 1] == 0)
    found = geodesic_distances(crumpled, faces, rim, rest_edges=rest)
    np.testing.assert_allclose(found, vertices[:, 1], atol=1e-6)


def test_what_no_way_leads_to_is_infinitely_far():
    vertices, faces = grid(3, 3)
    two = np.concatenate([vertices, vertices + 5]), np.concatenate([faces, faces + 9])
    found = geodesic_distances(*two, np.array([0]))
    assert np.isfinite(found[:9]).all() and np.isinf(found[9:]).all()


@pytest.mark.parametrize("sources", [[], [-1], [9]])
def test_refuses_sources_that_do_not_exist(sources):
    with pytest.raises(BadMesh, match="must be one of 9 vertices"):
        geodesic_distances(*grid(3, 3), np.array(sources, int))
