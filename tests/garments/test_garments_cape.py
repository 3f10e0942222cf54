"""The cape: its size, its cut, outside of any body, nothing crossed; libigl judges."""

import igl
import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadGarment
from hemline.garments import CapeCut, make_cape
from hemline.garments.cut.sector import grid_faces, grid_size, sector_pattern
from hemline.meshes import boundary_loops, check_mesh, edge_strains, self_crossings, vertex_normals


def distances(shaped, points):
    """Signed distances from libigl: nearest points, sign by winding number."""
    vertices, faces = shaped.vertices.astype(np.float64), shaped.body.faces.astype(np.int64)
    points = np.ascontiguousarray(points, np.float64)
    distance = np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces)[0])
    near = distance < 0.05
    inside = np.zeros(len(points), bool)
    inside[near] = np.asarray(igl.fast_winding_number(vertices, faces, points[near])) > 0.5
    return np.where(inside, -distance, distance)


@pytest.mark.parametrize(("name", "count", "strain"), [("cape", 12690, 0.09), ("cape-light", 4000, 0.10)])
def test_what_ships(shaped, name, count, strain):
    cape = garments.load(name)
    assert len(cape.vertices) == count and cape.key_joint == "neck" and cape.flat_rest and cape.notes == ()
    assert check_mesh(cape.vertices, cape.faces) == () and len(boundary_loops(cape.faces)) == 1
    assert distances(shaped, cape.vertices).min() > 0.003
    stretch = np.abs(edge_strains(cape.vertices, cape.faces, cape.rest_edges))
    assert np.percentile(stretch, 99) < strain and np.median(stretch) < 0.015 and stretch.max() < 0.25
    assert self_crossings(cape.vertices, cape.faces)["pairs"] == 0
    assert garments.load(name) is cape


def test_it_hangs_from_the_shoulders_to_the_calf_behind_the_body(shaped):
    cape = garments.load("cape")
    rim, hem = cape.vertices[:141], cape.vertices[-141:]
    neck, knee, ankle = (shaped.joints[joint] for joint in (12, 4, 7))
    assert 0.25 < np.ptp(rim[:, 0]) < np.ptp(shaped.joints[[16, 17], 0])
    assert np.abs(rim[:, 1] - neck[1]).max() < 0.09
    assert ankle[1] < hem[:, 1].mean() < knee[1] and hem[:, 2].max() < shaped.vertices[:, 2].min() + 0.1
    assert rim[0, 0] < 0 < rim[-1, 0]


def test_pins_are_the_first_two_rows_on_the_skin(shaped):
    cape = garments.load("cape")
    assert cape.pins.vertices.tolist() == list(range(282))
    assert cape.pins.heights.min() > 0.003 and cape.pins.heights.max() < 0.0065
    found = cape.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    np.testing.assert_allclose(found, cape.vertices[cape.pins.vertices], atol=2e-6)


def test_outside_is_the_side_away_from_the_body(shaped):
    cape = garments.load("cape")
    outward = vertex_normals(cape.vertices.astype(np.float64), cape.faces)
    assert outward[141 * 40 : 141 * 80, 2].mean() < -0.5  # behind the body, facing backward


def test_rest_triangles_are_the_flat_sector():
    cape = garments.load("cape-light")
    area = np.linalg.det(cape.rest_edges).sum() / 2
    rim = np.linalg.norm(np.diff(cape.vertices[:80].astype(np.float64), axis=0), axis=1).sum()
    opening = CapeCut().opening
    length = np.sqrt((rim / opening) ** 2 + 2 * area / opening) - rim / opening
    assert 1.0 < length < 1.3  # area of a ring sector, solved for its length
    assert (np.linalg.det(cape.rest_edges) > 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_it_fits_five_random_bodies(seed):
    betas = np.clip(np.random.default_rng(seed).normal(size=16), -2.5, 2.5)
    shaped = bodies.load("anny24").shaped(betas)
    cape = make_cape(shaped, vertex_count=3000)
    assert distances(shaped, cape.vertices).min() > 0.003
    stretch = np.abs(edge_strains(cape.vertices, cape.faces, cape.rest_edges))
    assert np.percentile(stretch, 99) < 0.17 and np.median(stretch) < 0.02
    assert self_crossings(cape.vertices, cape.faces)["pairs"] == 0
    np.testing.assert_array_equal(cape.body_betas, shaped.betas)


def test_same_body_same_bits(shaped):
    assert make_cape(shaped, vertex_count=1000).hash == make_cape(shaped, vertex_count=1000).hash


def test_any_size_can_be_asked_for(shaped):
    cape = make_cape(shaped, rows=20, columns=31, material="silk", cut=CapeCut(length=0.8, folds=3))
    assert len(cape.vertices) == 620 and cape.material.name == "silk"
    assert cape.vertices[:, 1].max() - cape.vertices[:, 1].min() < 0.85
    odd = make_cape(shaped, vertex_count=1009)  # a prime
    assert abs(len(odd.vertices) - 1009) <= 5 and "1009 vertices were asked for" in odd.notes[0]


@pytest.mark.parametrize(("count", "size"), [(12690, (90, 141)), (4000, (50, 80)), (1500, (31, 48))])
def test_grid_sizes(count, size):
    rows, columns = grid_size(count, 141 / 90)
    assert abs(rows * columns - count) <= abs(size[0] * size[1] - count)
    assert columns / rows == pytest.approx(141 / 90, rel=0.13)


def test_grid_faces_cover_the_sector_with_alternating_diagonals():
    flat = sector_pattern(5, 7, rim=0.4, length=1.0, opening=1.1)
    faces = grid_faces(5, 7)
    corner = flat[faces]
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    # columns run to the right here, so triangles are clockwise
    areas = (one[:, 1] * two[:, 0] - one[:, 0] * two[:, 1]) / 2
    assert (areas > 0).all() and len(faces) == 2 * 4 * 6
    # chords cut off a sliver of each arc
    assert areas.sum() == pytest.approx((0.4 + 0.55) * 1.0, rel=0.01)
    degree = np.bincount(faces.reshape(-1)).reshape(5, 7)[1:-1, 1:-1]
    assert set(degree.reshape(-1).tolist()) == {4, 8}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rows": 20}, "must be rows and columns, or vertex_count"),
        ({"rows": 5, "columns": 30}, "at least 6 rows and 10 columns; got 5 rows, 30 columns"),
        ({"vertex_count": 0}, "at least 6 rows and 10 columns"),
        ({"cut": CapeCut(opening=9.0)}, "cut cannot be made"),
        ({"material": "tin"}, "unknown material"),
    ],
)
def test_refuses(shaped, options, message):
    with pytest.raises(BadGarment, match=message):
        make_cape(shaped, **options)


def test_refuses_a_body_without_shoulders(shaped):
    from dataclasses import replace

    fallen = replace(shaped, joints=shaped.joints + np.array([0, 0, 3], np.float32))
    with pytest.raises(BadGarment, match="needs shoulders"):
        make_cape(fallen, vertex_count=1000)
