"""Polygons cut into triangles: no area is lost, none is counted twice, and no edge gets a third triangle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hemline.errors import BadMesh
from hemline.meshes import read_mesh
from hemline.meshes.edges import directed_edges
from hemline.meshes.reading.polygons import CORNERS_MAX, cut_polygons


def star(radii):
    """A polygon around the origin, counter-clockwise, concave where its radii alternate; in a tilted plane."""
    angle = 2 * np.pi * np.arange(len(radii)) / len(radii)
    flat = np.stack([radii * np.cos(angle), radii * np.sin(angle)], axis=1)
    tilt = np.array([[0.6, 0.8, 0.0], [-0.48, 0.36, 0.8]])
    return flat, flat @ tilt + (3, -2, 5)


def signed_areas(flat, triangles):
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def shoelace(flat):
    following = np.roll(flat, -1, axis=0)
    return 0.5 * float((flat[:, 0] * following[:, 1] - flat[:, 1] * following[:, 0]).sum())


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(0.2, 3.0), min_size=4, max_size=24))
def test_a_polygon_is_covered_once(radii):
    flat, points = star(np.array(radii))
    triangles = cut_polygons(points, np.arange(len(points)), np.array([len(points)]))
    areas = signed_areas(flat, triangles)
    assert len(triangles) == len(points) - 2 and (areas > -1e-9).all()
    assert areas.sum() == pytest.approx(shoelace(flat))
    outline = {tuple(edge) for edge in directed_edges(triangles).tolist()}
    assert all((k, (k + 1) % len(points)) in outline for k in range(len(points)))


def test_a_corner_in_the_middle_of_a_side_makes_no_triangle_without_area():
    points = np.array([[0, 0, 0], [0.5, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    triangles = cut_polygons(points, np.arange(5), np.array([5]))
    assert (signed_areas(points[:, :2], triangles) > 0.1).all() and set(triangles.ravel()) == set(range(5))


def test_two_quads_that_share_two_sides_share_no_diagonal():
    # vertex 2 has two quads alone: the usual diagonal of both would be from 1 to 3
    points = np.array([[0, 0, 0], [1, 0, 0], [0.9, 0.9, 0], [0, 1, 0], [2, 2, 0]], float)
    corners = np.array([1, 2, 3, 0, 3, 2, 1, 4])
    triangles = corners[cut_polygons(points, corners, np.array([4, 4]))]
    times = np.unique(np.sort(directed_edges(triangles), axis=1), axis=0, return_counts=True)[1]
    assert times.max() == 2


def test_convex_quads_keep_the_diagonal_from_their_first_corner(tmp_path):
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4 1\n")
    assert read_mesh(tmp_path / "a.obj").faces.tolist() == [[1, 2, 3], [1, 3, 0]]


def test_an_endless_polygon_is_refused():
    count = CORNERS_MAX + 1
    with pytest.raises(BadMesh, match=f"may have {CORNERS_MAX} corners; got {count}"):
        cut_polygons(np.zeros((count, 3)), np.arange(count), np.array([count]))


def test_a_polygon_without_area_is_cut_all_the_same():
    points = np.repeat(np.arange(6.0)[:, None], 3, axis=1)
    assert len(cut_polygons(points, np.arange(6), np.array([6]))) == 4
