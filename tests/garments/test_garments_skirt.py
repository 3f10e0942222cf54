"""The skirt: the size and the chains of the paper, flat without a seam, outside of any body; libigl judges."""

from dataclasses import replace

import igl
import numpy as np
import pytest

from hemline import bodies, garments, sim
from hemline.errors import BadGarment
from hemline.garments import SkirtCut, make_skirt
from hemline.garments.cut.skirt_drape import line_tilts, outward_of, pleat_sheet
from hemline.meshes import (
    ClosestTree,
    boundary_loops,
    check_mesh,
    edge_lengths,
    edge_strains,
    edges,
    self_crossings,
    vertex_normals,
)
from hemline.motions.motion import JOINT_NAMES

STATURE, BULK = 0, 4
"""Betas that change height (1.3 to 2.1 m at 2.5 of them) and volume (44 to 84 litres)."""


def along(beta, value):
    return np.where(np.arange(16) == beta, value, 0.0)


SHAPES = {
    "mean": np.zeros(16),
    "short": along(STATURE, -2.5),
    "tall": along(STATURE, 2.5),
    "thin": along(BULK, -2.5),
    "heavy": along(BULK, 2.5),
} | {f"random {seed}": np.random.default_rng(seed).normal(size=16) for seed in range(8)}


def shape(name):
    return bodies.load("anny24").shaped(SHAPES[name])


def distances(shaped, points):
    """Signed distances from libigl: nearest points, sign by winding number."""
    vertices, faces = shaped.vertices.astype(np.float64), shaped.body.faces.astype(np.int64)
    points = np.ascontiguousarray(points, np.float64)
    distance = np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces)[0])
    inside = np.asarray(igl.fast_winding_number(vertices, faces, points)) > 0.5
    return np.where(inside, -distance, distance)


def height_of(shaped, name):
    return float(shaped.joints[JOINT_NAMES.index(name), 1])


def interior_angle_sums(skirt):
    """Sum of the angles of the flat rest triangles around each vertex that is not on a boundary [rad]."""
    a, b, c = edge_lengths(skirt.rest_edges).T  # 0-1, 1-2, 2-0
    corners = np.stack([_angle(a, c, b), _angle(a, b, c), _angle(b, c, a)], axis=1)
    sums = np.bincount(skirt.faces.reshape(-1), corners.reshape(-1), minlength=len(skirt.vertices))
    return np.delete(sums, np.concatenate(boundary_loops(skirt.faces)))


def _angle(one, other, opposite):
    return np.arccos((one**2 + other**2 - opposite**2) / (2 * one * other))


@pytest.mark.parametrize(("name", "count", "columns"), [("skirt", 18546, 281), ("skirt-light", 3978, 117)])
def test_what_ships(shaped, name, count, columns):
    skirt = garments.load(name)
    assert len(skirt.vertices) == count and skirt.key_joint == "pelvis" and skirt.flat_rest and skirt.notes == ()
    assert check_mesh(skirt.vertices, skirt.faces) == ()
    assert sorted(len(loop) for loop in boundary_loops(skirt.faces)) == [columns, columns]
    assert len(skirt.faces) == 2 * (count - columns)
    assert garments.load(name) is skirt and name in garments.names()


@pytest.mark.parametrize("name", ["skirt", "skirt-light"])
def test_chains_are_those_of_the_paper(name):
    skirt = garments.load(name)
    chains = np.array(skirt.chains)
    assert chains.shape == (26, 9) and len(np.unique(chains)) == 234
    columns = len(boundary_loops(skirt.faces)[0])
    row, column = np.divmod(chains, columns)
    assert (row[:, 0] == 1).all() and (row[:, -1] == len(skirt.vertices) // columns - 1).all()
    assert (np.diff(row, axis=1) == np.diff(row, axis=1)[0, 0]).all()
    assert np.isin(chains[:, 0], skirt.pins.vertices).all() and not np.isin(chains[:, 1:], skirt.pins.vertices).any()
    assert (column == column[:, :1]).all()
    gaps = np.diff(np.append(column[:, 0], columns + column[0, 0]))
    assert gaps.min() >= columns / 26 - 1 and gaps.max() <= columns / 26 + 1


@pytest.mark.parametrize("name", ["skirt", "skirt-light"])
def test_the_cut_is_flat_everywhere_also_where_the_sector_closes(name):
    skirt = garments.load(name)
    np.testing.assert_allclose(interior_angle_sums(skirt), 2 * np.pi, atol=2e-4)


def test_triangles_on_both_sides_of_an_edge_have_it_equally_long():
    skirt = garments.load("skirt-light")
    pairs = np.sort(np.stack([skirt.faces, np.roll(skirt.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    lengths = edge_lengths(skirt.rest_edges).reshape(-1)
    _, which, counts = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    longest = np.zeros(len(counts))
    np.maximum.at(longest, which, lengths)
    assert (counts == 2).sum() == len(counts) - 2 * 117 and len(edges(skirt.faces)) == len(counts)
    np.testing.assert_allclose(lengths, longest[which], atol=3e-8)


def test_the_cut_is_a_ring_sector(shaped):
    cut = SkirtCut(opening=3.0, length=0.5)
    skirt = make_skirt(shaped, rows=20, columns=200, cut=cut)
    rim = skirt.vertices[:200].astype(np.float64)
    width = np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum()
    area = np.linalg.det(skirt.rest_edges) / 2
    assert (area > 0).all()
    assert area.sum() == pytest.approx(width * 0.5 + 3.0 * 0.5**2 / 2, rel=1e-3)


@pytest.mark.parametrize("name", SHAPES)
def test_it_fits_any_body(name):
    shaped = shape(name)
    skirt = make_skirt(shaped, rows=34, columns=117)
    assert distances(shaped, skirt.vertices).min() > 0.003
    strain = np.abs(edge_strains(skirt.vertices, skirt.faces, skirt.rest_edges))
    assert np.median(strain) < 0.012 and np.percentile(strain, 99) < 0.1 and strain.max() < 0.25
    assert self_crossings(skirt.vertices, skirt.faces)["pairs"] == 0
    np.testing.assert_array_equal(skirt.body_betas, shaped.betas)
    pinned = skirt.vertices[skirt.pins.vertices, 1]
    assert height_of(shaped, "left_hip") + 0.08 < pinned.min() and pinned.max() < height_of(shaped, "spine3")
    assert np.ptp(pinned) < 0.012
    knee, ankle, hem = height_of(shaped, "left_knee"), height_of(shaped, "left_ankle"), skirt.vertices[-117:, 1].mean()
    assert knee - 0.4 * (knee - ankle) < hem < knee


@pytest.mark.parametrize("name", ["short", "tall", "thin", "heavy", "random 3"])
def test_the_skirt_of_the_mean_body_is_dressed_on_others(name):
    shaped = shape(name)
    dressed = garments.load("skirt-light").dressed(shaped)
    assert distances(shaped, dressed.vertices).min() > 0.003
    assert self_crossings(dressed.vertices, dressed.faces)["pairs"] == 0
    pinned = dressed.vertices[dressed.pins.vertices, 1]
    assert height_of(shaped, "left_hip") + 0.05 < pinned.min() and pinned.max() < height_of(shaped, "spine3")


def test_pins_are_the_first_two_rows_on_the_skin(shaped):
    skirt = garments.load("skirt")
    assert skirt.pins.vertices.tolist() == list(range(562))
    assert skirt.pins.heights.min() > 0.0035 and skirt.pins.heights.max() < 0.012
    found = skirt.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    np.testing.assert_allclose(found, skirt.vertices[skirt.pins.vertices], atol=2e-6)


def test_it_settles_on_the_waist_and_does_not_fall(shaped):
    skirt = make_skirt(shaped, rows=18, columns=60)
    rest = sim.rest_drape(skirt, shaped)
    rows = rest.vertices[0].reshape(18, 60, 3)
    np.testing.assert_allclose(rows[:2].reshape(-1, 3), skirt.vertices[:120], atol=1e-5)
    assert np.diff(rows[:, :, 1].mean(axis=1)).min() > -0.045  # 4.2 cm of cloth from row to row
    assert rows[-1, :, 1].min() > rows[0, :, 1].max() - 0.75
    assert rows[-1, :, 1].mean() < height_of(shaped, "left_knee")
    assert distances(shaped, rest.vertices[0]).min() > 0
    assert self_crossings(rest.vertices[0], skirt.faces)["pairs"] == 0


def test_outside_is_the_side_away_from_the_body():
    skirt = garments.load("skirt-light")
    outward = vertex_normals(skirt.vertices.astype(np.float64), skirt.faces)
    middle = skirt.vertices.mean(axis=0)
    assert (((skirt.vertices - middle) * outward)[:, [0, 2]].sum(axis=1) > 0).mean() > 0.95


def test_it_begins_behind_and_goes_round_over_the_left():
    rim = garments.load("skirt").vertices[:281]
    assert abs(rim[0, 0]) < 0.005 and rim[0, 2] == pytest.approx(rim[:, 2].min(), abs=0.01)
    assert rim[70, 0] > 0.1 and rim[140, 2] > rim[0, 2] + 0.15 and rim[210, 0] < -0.1


def test_left_and_right_are_alike():
    skirt = garments.load("skirt")
    grid = skirt.vertices.reshape(66, 281, 3)
    mirrored = grid[:, -np.arange(281) % 281] * np.array([-1, 1, 1], np.float32)
    assert np.linalg.norm(mirrored - grid, axis=2).max() < 0.01


def test_same_body_same_bits(shaped):
    assert make_skirt(shaped, rows=20, columns=60).hash == make_skirt(shaped, rows=20, columns=60).hash


def test_any_size_and_cut_can_be_asked_for(shaped):
    wide = make_skirt(shaped, rows=20, columns=80, material="silk", cut=SkirtCut(opening=5.5, length=0.5, folds=6))
    narrow = make_skirt(shaped, rows=20, columns=80, cut=SkirtCut(opening=2.2, length=0.5))
    assert len(wide.vertices) == 1600 and wide.material.name == "silk"
    assert np.linalg.det(wide.rest_edges).sum() > 1.4 * np.linalg.det(narrow.rest_edges).sum()
    for skirt in (wide, narrow):
        assert np.ptp(skirt.vertices[:, 1]) < 0.5 and self_crossings(skirt.vertices, skirt.faces)["pairs"] == 0
    odd = make_skirt(shaped, vertex_count=3001)
    assert abs(len(odd.vertices) - 3001) <= 5 and "3001 vertices were asked for" in odd.notes[0]


def test_directions_turn_evenly_though_the_back_is_hollow():
    angle = 2 * np.pi * np.arange(80) / 80
    radius = 0.12 - 0.02 * np.exp(-((angle - np.pi) ** 2) / 0.02)
    rim = np.stack([1.3 * radius * np.sin(angle), 0 * angle, radius * np.cos(angle)], axis=1)
    outward = outward_of(rim)
    turn = np.diff(np.unwrap(np.arctan2(outward[:, 0], outward[:, 2])))
    np.testing.assert_allclose(np.linalg.norm(outward, axis=1), 1)
    assert (turn > 0).all() and turn.max() < 0.2


def test_lines_lean_out_as_far_as_a_ball_below_asks():
    ball = _ball(0.2)
    angle = 2 * np.pi * np.arange(36) / 36
    rim = np.stack([0.1 * np.sin(angle), np.full(36, 0.19), 0.1 * np.cos(angle)], axis=1)
    tilts = line_tilts(rim, outward_of(rim), ball, length=0.5, tilt=0.1, clearance=0.005)
    # the tangent to a circle of 0.205 m from the point (0.1, 0.19)
    reach = np.hypot(0.1, 0.19)
    tangent = np.arcsin(0.205 / reach) - np.arctan2(0.1, 0.19) if reach > 0.205 else np.nan
    assert tilts.min() > tangent - 0.03 and tilts.max() < tangent + 0.1
    with pytest.raises(BadGarment, match="must hang past the body"):
        line_tilts(rim - [0, 0.3, 0], outward_of(rim), ball, length=0.5, tilt=0.1, clearance=0.005)


def _ball(radius):
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=4, radius=radius)
    return ClosestTree(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int32))


def test_pleats_give_each_row_its_width_and_lie_outside():
    angle = 2 * np.pi * np.arange(90) / 90
    outward = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    sheet = np.stack([0.2 * outward, 0.2 * outward - [0, 0.1, 0]])
    laid = pleat_sheet(sheet, outward, np.array([1.3, 1.9]), np.array([0.0, 1.0]), 6)
    widths = np.linalg.norm(laid - np.roll(laid, 1, axis=1), axis=2).sum(axis=1)
    np.testing.assert_allclose(widths, [0.4 * np.pi, 1.9], rtol=0.005)
    assert np.hypot(laid[1, :, 0], laid[1, :, 2]).min() > 0.1999


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rows": 20}, "must be rows and columns, or vertex_count"),
        ({"rows": 9, "columns": 60}, "at least 10 rows and 52 columns; got 9 rows, 60 columns"),
        ({"rows": 20, "columns": 51}, "at least 10 rows and 52 columns; got 20 rows, 51 columns"),
        ({"vertex_count": 0}, "at least 10 rows and 52 columns"),
        ({"cut": SkirtCut(opening=7.0)}, "cut cannot be made"),
        ({"cut": SkirtCut(folds=0)}, "cut cannot be made"),
        ({"cut": SkirtCut(height=0.0)}, "cut cannot be made"),
        ({"cut": SkirtCut(length=0.05)}, "cut cannot be made"),
        ({"cut": SkirtCut(opening=1.0)}, r"must open by \d\.\d\d rad or more to pass the body; got 1.0 rad"),
        ({"material": "tin"}, "unknown material"),
    ],
)
def test_refuses(shaped, options, message):
    with pytest.raises(BadGarment, match=message):
        make_skirt(shaped, **options)


def test_refuses_a_body_without_a_waist(shaped):
    fallen = replace(shaped, joints=shaped.joints + np.array([0, 3, 0], np.float32))
    with pytest.raises(BadGarment, match="needs a waist to hang from; got no trunk at 3"):
        make_skirt(fallen, rows=20, columns=60)


def test_a_skirt_without_a_cut_opens_as_wide_as_the_hips_need(shaped):
    """On hips twice as wide; by a cut that is named it is refused, with the opening that is needed."""
    below = np.clip((0.1 - shaped.vertices[:, 1:2]) / 0.1, 0, 1)
    wide = replace(shaped, vertices=(shaped.vertices * (1 + 1.2 * below * (1, 0, 1))).astype(np.float32))
    with pytest.raises(BadGarment, match=r"must open by (4\.[2-9]|5\.[0-7])\d* rad or more"):
        make_skirt(wide, rows=20, columns=60, cut=SkirtCut())
    made = make_skirt(wide, rows=20, columns=60)
    usual = make_skirt(shaped, rows=20, columns=60)
    assert ClosestTree(wide.vertices.astype(float), wide.body.faces).signed_distances(made.vertices).min() > 0.002
    hem = [float(edge_lengths(each.rest_edges).mean()) for each in (made, usual)]
    assert hem[0] > 1.02 * hem[1]
