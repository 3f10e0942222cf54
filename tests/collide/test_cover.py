"""Cloth that lies close, moved out over the skin that looks through it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import hemline
from hemline import bodies, garments, metrics
from hemline.collide import Cover
from hemline.collide.cover.cover import (
    COVER_DEPTH,
    COVER_DISTANCE,
    COVER_GAP,
    COVER_MARGIN,
    LENGTHS,
    faces_across_edges,
)
from hemline.collide.cover.cover_kernels import CoveredPoints, CoveredSkin, cover_points, list_covered
from hemline.meshes import ClosestTree
from hemline.playback.player.player import Player


@cache
def dressed_shirt():
    """The T-shirt on its body, and what it may cover."""
    shaped, shirt = bodies.load("anny24").shaped(), garments.load("tshirt-light")
    return shaped, shirt, Cover.prepare(shaped, shirt.vertices, shirt.faces)


def idle(vertices, *corners: int) -> np.ndarray:
    """Which vertices are corners of triangles that cover nothing."""
    return np.isin(np.arange(len(vertices)), corners)


def single(points) -> tuple[np.ndarray, ...]:
    """One triangle in the plane z = 0 over all the points."""
    points = np.asarray(points, np.float32)
    vertices = np.array([[0, 0, 0], [0.03, 0, 0], [0, 0.03, 0]], np.float32)
    corners, which = np.array([[0, 1, 2]], np.int32), np.arange(len(points), dtype=np.int32)
    return which, np.zeros(len(points), np.int32), corners, faces_across_edges(corners), points, vertices


def cover(model, skin, vertices, *, sweeps: int = 1, corners: tuple[int, ...] = (), margin=COVER_MARGIN) -> int:
    """Moves triangles of `vertices` over the points, some times; returns how often one was moved."""
    model, count = CoveredSkin(*model), len(model[0])
    looked_at = CoveredPoints(np.empty(count, np.int32), np.empty(count + 1, np.int32))
    listed, still = list_covered(model, skin, LENGTHS, margin, vertices, looked_at), idle(vertices, *corners)
    return sum(cover_points(model, skin, still, LENGTHS, looked_at, listed, vertices) for _ in range(sweeps))


def covered(points, sweeps: int = 1) -> tuple[np.ndarray, int]:
    *model, skin, vertices = single(points)
    moved = cover(model, skin, vertices, sweeps=sweeps)
    return vertices, moved


def strip(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A grid of 12 by 12 vertices, 2 cm apart, a little uneven, and its triangles."""
    random = np.random.default_rng(seed)
    wide, long = np.meshgrid(np.arange(12), np.arange(12), indexing="ij")
    vertices = np.stack([0.02 * wide, 0.02 * long, random.uniform(-0.002, 0.002, (12, 12))], axis=-1)
    first = (12 * wide + long)[:-1, :-1].reshape(-1, 1)
    corners = np.concatenate([first + [0, 12, 13], first + [0, 13, 1]]).astype(np.int32)
    return vertices.reshape(-1, 3).astype(np.float32), corners


def test_a_triangle_moves_out_until_the_point_is_a_gap_behind_it():
    vertices, moved = covered([[0.008, 0.01, 0.004]])
    assert moved == 1
    # the triangle tilts: the place of the point in it moves by what was lacking along the old normal
    first = 1 - 0.008 / 0.03 - 0.01 / 0.03
    place = first * vertices[0] + (0.008 / 0.03) * vertices[1] + (0.01 / 0.03) * vertices[2]
    np.testing.assert_allclose(place, [0.008, 0.01, 0.004 + COVER_GAP], atol=1e-7)
    assert (vertices[:, 2] > 0).all() and vertices[:, :2].max() <= 0.03


@pytest.mark.parametrize(
    "point",
    [
        [0.008, 0.01, -COVER_GAP - 1e-4],  # behind it already
        [0.008, 0.01, COVER_DEPTH],  # too far in front: not its own
        [0.02, 0.02, 0.004],  # beside it, beyond the rim
    ],
)
def test_what_it_does_not_cover_moves_nothing(point):
    vertices, moved = covered([point])
    assert moved == 0
    np.testing.assert_array_equal(vertices, single([point])[-1])


def test_a_triangle_with_an_idle_corner_covers_nothing():
    *model, skin, vertices = single([[0.008, 0.01, 0.004]])
    assert cover(model, skin, vertices, corners=(1,)) == 0
    assert cover(model, skin, vertices) == 1


def test_a_triangle_without_area_covers_nothing():
    *model, skin, vertices = single([[0.0, 0.0, 0.001]])
    vertices[:] = vertices[0]
    assert cover(model, skin, vertices, sweeps=2) == 0
    assert np.isfinite(vertices).all()


def test_the_kernel_equals_plain_numpy():
    random = np.random.default_rng(0)
    points = np.column_stack([random.uniform(0, 0.02, (40, 2)), random.uniform(-0.004, 0.006, 40)])
    found, moved = covered(points, sweeps=3)
    plain, count = single(points)[-1].astype(np.float64), 0
    for _ in range(3):
        for point in points.astype(np.float32).astype(np.float64):
            edges = plain[1:] - plain[0]
            normal = np.cross(*edges)
            normal /= np.linalg.norm(normal)
            lack = (point - plain[0]) @ normal + COVER_GAP
            (second, third), *_ = np.linalg.lstsq(edges.T, point - plain[0] - (lack - COVER_GAP) * normal, rcond=None)
            weights = np.array([1 - second - third, second, third])
            if 0 < lack <= COVER_DEPTH and (weights >= 0).all():
                plain += lack / (weights @ weights) * weights[:, None] * normal
                count += 1
    np.testing.assert_allclose(found, plain, atol=2e-6)
    assert abs(moved - count) <= 2 and count > 5


def test_triangles_across_edges_are_each_other_s_neighbours():
    _, corners = strip(0)
    beyond = faces_across_edges(corners)
    inner = 3 * len(corners) - 4 * 11  # all but the rim
    assert (beyond >= 0).sum() == inner
    for face, corner in np.argwhere(beyond >= 0):
        shared = np.delete(corners[face], corner)
        assert np.isin(shared, corners[beyond[face, corner]]).all() and beyond[face, corner] != face
        assert face in beyond[beyond[face, corner]]


def test_wherever_cloth_has_slipped_to_the_triangle_over_a_point_is_found():
    """From a triangle 3 or 4 cm away, as from the right one at once."""
    vertices, corners = strip(0)
    vertices[:, 2] = 0
    random, middles = np.random.default_rng(0), vertices[corners].mean(axis=1)
    skin = np.column_stack([random.uniform(0.06, 0.16, (20, 2)), random.uniform(0, 0.006, 20)]).astype(np.float32)
    right = ClosestTree(vertices.astype(np.float64), corners).closest(skin).faces
    slipped = np.linalg.norm(middles[:, None] - (middles[right] + [0.03, 0.02, 0]), axis=2).argmin(axis=0)
    assert (np.linalg.norm(middles[slipped] - middles[right], axis=1) > 0.025).all()
    for point in range(20):
        results = [vertices.copy(), vertices.copy()]
        for over, moving in zip((right, slipped), results, strict=True):
            model = (
                np.zeros(1, np.int32),
                over[point : point + 1].astype(np.int32),
                corners,
                faces_across_edges(corners),
            )
            assert cover(model, skin[point : point + 1], moving) == 1
        np.testing.assert_array_equal(*results)


def test_points_far_behind_the_cloth_are_rightly_left_out():
    """A grid of which some triangles are moved in three sweeps: as when all points are looked at in each."""
    random = np.random.default_rng(1)
    vertices, corners = strip(1)
    skin = np.column_stack([random.uniform(0, 0.22, (300, 2)), random.uniform(-0.02, 0.002, 300)]).astype(np.float32)
    over = ClosestTree(vertices.astype(np.float64), corners).closest(skin).faces.astype(np.int32)
    model = np.arange(300, dtype=np.int32), over, corners, faces_across_edges(corners)
    few, every = vertices.copy(), vertices.copy()
    moved = cover(model, skin, few, sweeps=3)
    assert cover(model, skin, every, sweeps=3, margin=np.float32(1.0)) == moved > 30
    np.testing.assert_array_equal(few, every)
    looked_at = CoveredPoints(np.empty(300, np.int32), np.empty(301, np.int32))
    assert list_covered(CoveredSkin(*model), skin, LENGTHS, COVER_MARGIN, vertices, looked_at) < 200


def test_what_is_covered_is_near_at_rest_and_faces_the_same_way():
    shaped, shirt, cover = dressed_shirt()
    corners = shirt.vertices[cover.corners[cover.over]].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("px,px->p", normals, shaped.normals[cover.points]) > 0).all()
    nearest = np.linalg.norm(corners - shaped.vertices[cover.points][:, None], axis=2).min(axis=1)
    assert nearest.max() < 2 * COVER_DISTANCE and len(cover.points) > 1000
    hanging = garments.load("cape-light")
    assert len(Cover.prepare(shaped, hanging.vertices, hanging.faces).points) < len(cover.points)


def test_skin_that_looks_out_is_covered_by_another_count():
    """Cloth drawn tight, so that the chest looks out: counted by the nearest place of the cloth."""
    shaped, shirt, cover = dressed_shirt()
    skin = metrics.skin_under_cloth(shirt.vertices, shirt.faces, shaped.vertices, shaped.normals)
    tight = (shirt.vertices - shirt.vertices.mean(axis=0)) * np.float32([0.97, 1.0, 0.97]) + shirt.vertices.mean(axis=0)

    def through(vertices):
        return metrics.skin_through_percent(vertices, shirt.faces, shaped.vertices, shaped.normals, skin)

    before, after = through(tight), through(cover.step(shaped.vertices, tight))
    assert through(shirt.vertices) == 0 and before > 5
    assert after < 0.1 * before
    np.testing.assert_array_equal(
        cover.step(shaped.vertices, shirt.vertices + 0.1 * shaped.normals[0]).shape, (3150, 3)
    )


def test_a_player_covers_where_it_keeps_cloth_whole_and_out_of_the_body_itself():
    cape, body = hemline.load("cape"), bodies.load("anny24").shaped()
    assert Player.prepare(cape, body).cover is not None
    assert Player.prepare(cape, body, whole=False).cover is None
    assert Player.prepare(cape, body, detail=0.25).cover is None


def test_the_projection_has_the_last_word():
    """Whatever is moved out over skin is out of the body after the frame: cloth moved out of a chest, into an arm."""
    cape, body = hemline.load("cape"), bodies.load("anny24").shaped()
    player, dance = Player.prepare(cape, body), hemline.motions.load("dance")
    everything = replace(player, cover=(Cover.prepare(body, cape.garment.vertices, cape.garment.faces),))
    state = everything.start(dance[0])
    for index in range(6):
        state, frame = everything.step(state, dance[8 * index], 1 / 30)
        inside = hemline.collide.inside(frame.body.vertices, frame.body.faces, frame.vertices)
        inside[frame.report.pinched] = False
        assert not inside.any()
