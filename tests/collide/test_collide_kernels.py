"""Kernels of the projection against plain NumPy, scipy, trimesh and exact distances."""

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from hemline.collide.projection.displace_lane_kernels import LANES, ROWS, lift_distance, lift_lanes, project_lanes
from hemline.collide.projection.escape_kernels import find_escape_faces
from hemline.collide.projection.project import Projector
from hemline.collide.projection.project_frame import ProjectedFrame
from hemline.collide.projection.ray_kernels import SKYLINE_MARGIN, certify
from hemline.collide.surface.box_kernels import into_frame
from hemline.collide.surface.search_kernels import search_buffers, seek_block, seek_place, some_face
from hemline.collide.surface.surface_kernels import nearest_weights
from hemline.collide.winding.numbers import winding_numbers
from hemline.meshes import ClosestTree
from tests.collide.projection_samples import Skintight, clip, sheet_behind


@pytest.fixture(scope="module")
def frame():
    shaped, poses, _ = clip("dance", frames=1, first=30)
    cloth = Skintight(shaped, 3000)
    projector = Projector.prepare(shaped, cloth.rest, np.empty((0, 3), np.int32))
    loose = cloth.over(poses[0], 0.0) + np.random.default_rng(0).normal(0, 0.05, (3000, 1)).astype(np.float32)
    return ProjectedFrame(projector, projector.start(), poses[0], loose)


def test_into_the_frame_of_a_bone_and_back(frame):
    turn, shift = frame.to_world[:, :3], frame.to_world[:, 3]
    assert np.allclose(frame.points @ turn.T + shift, frame.vertices[frame.projector.on_body.order], atol=2e-6)
    again = np.empty_like(frame.points)
    every = np.arange(len(again), dtype=np.int32)
    into_frame(np.eye(3, 4, dtype=np.float32), frame.points, every, again)
    assert (again == frame.points).all()


def test_boxes_hold_what_they_should(frame):
    patches = frame.patches
    for leaf in range(0, len(patches.leaf_start) - 1, 91):
        corners = frame.skin.body[patches.faces[leaf * 8 : leaf * 8 + 8].reshape(-1)]
        assert (frame.skin.leaf_box[:, leaf] == np.concatenate([corners.min(0), corners.max(0)])).all()
    for patch, (first, last) in enumerate(zip(patches.patch_start[:-1], patches.patch_start[1:], strict=True)):
        held = frame.skin.leaf_box[:, first:last]
        assert (frame.skin.patch_box[:, patch] == np.concatenate([held[:3].min(1), held[3:].max(1)])).all()


@pytest.mark.parametrize("way", range(6))
def test_winding_numbers_are_the_same_along_all_six_directions(frame, way):
    frame.state.directions[:] = way
    found, _ = frame.windings(frame.points, np.arange(len(frame.points), dtype=np.int32))
    expected = winding_numbers(frame.skin.body, frame.patches.faces, frame.points)
    assert set(np.unique(expected)) >= {0, 1}
    assert (found == expected).all()


def test_certified_vertices_are_free_by_the_margin():
    shaped, poses, _ = clip("run", frames=1, first=10)
    rest, carried = sheet_behind(shaped)
    projector = Projector.prepare(shaped, rest, np.empty((0, 3), np.int32))
    frame = ProjectedFrame(projector, projector.start(), poses[0], carried(poses[0], 0.0))
    state, near = frame.projector.start(), np.empty(len(frame.points), np.int32)
    count = certify(frame.points, frame.skin.patch_box, state.lively, 1, 5, state.directions, state.hidden, near)
    certified = np.setdiff1d(np.arange(len(frame.points)), near[:count])
    assert len(certified) > 0.5 * len(frame.points)
    assert (winding_numbers(frame.skin.body, frame.patches.faces, frame.points[certified]) == 0).all()
    tree = ClosestTree(frame.skin.body.astype(float), frame.patches.faces)
    assert (tree.closest(frame.points[certified]).distances >= SKYLINE_MARGIN - 1e-6).all()


def test_nearest_weights_against_trimesh():
    random = np.random.default_rng(2)
    corners, points = random.normal(size=(400, 3, 3)), random.normal(size=(400, 3)) * 1.5
    theirs = trimesh.triangles.closest_point(corners, points)
    for triangle, point, nearest in zip(corners, points, theirs, strict=True):
        a, b, c = (tuple(np.float32(each)) for each in triangle - point)
        s, t = nearest_weights(a, b, c)
        assert np.allclose((1 - s - t) * triangle[0] + s * triangle[1] + t * triangle[2], nearest, atol=1e-5)


def test_sought_places_are_nearest(frame):
    patches, points = frame.patches, frame.points[::10]
    room = search_buffers(frame.skin)

    def distances(limb):
        rows = [seek_place(frame.skin, limb, some_face(frame.skin, limb), *point, room) for point in points]
        return np.sqrt([squared for _, _, _, squared in rows])

    limb = patches.limb[0]
    own = cKDTree(frame.skin.body[patches.limb == limb]).query(points)[0]
    assert (distances(limb) <= own + 1e-6).all()
    real = patches.faces[patches.faces[:, 0] != patches.faces[:, 1]]
    exact = ClosestTree(frame.skin.body.astype(float), real).closest(points).distances
    error = np.abs(distances(np.int32(-1)) - exact)
    assert (error < 1e-5).mean() > 0.9
    assert error.max() < 5e-3


def test_points_that_look_together_find_what_each_finds_alone(frame):
    skin, room = frame.skin, search_buffers(frame.skin)
    for limb in (np.int32(-1), frame.projector.on_body.limb[0]):
        start, found = some_face(skin, limb), np.empty(8, np.int64)
        for first in range(0, 400, 8):
            which, faces = np.arange(first, first + 8), np.full(8, start)
            seek_block(skin, limb, frame.points, which, faces, 8, room, found)
            for point, vertex in zip(frame.points[which], found, strict=True):
                own = np.arange(len(skin.body)) if limb < 0 else own_vertices(frame, limb)
                nearest = own[np.linalg.norm(skin.body[own] - point, axis=1).argmin()]
                away = np.linalg.norm(skin.body[[vertex, nearest]] - point, axis=1)
                assert away[0] == pytest.approx(away[1], rel=1e-6)


def test_fewer_than_eight_points_that_look_together_find_the_same(frame):
    skin, room, which = frame.skin, search_buffers(frame.skin), np.arange(40, 48)
    start, every, some = np.full(8, some_face(skin, np.int32(-1))), np.empty(8, np.int64), np.full(8, -7)
    seek_block(skin, np.int32(-1), frame.points, which, start, 8, room, every)
    seek_block(skin, np.int32(-1), frame.points, which, start, 3, room, some)
    np.testing.assert_array_equal(some, [*every[:3], -7, -7, -7, -7, -7])


def own_vertices(frame, limb):
    """Vertices around which a face belongs to a limb."""
    faces = frame.patches.faces.reshape(-1, 8, 3)[frame.patches.leaf_limb == limb]
    return np.unique(faces)


def test_looking_around_finds_the_nearest_vertex_of_all_and_of_the_own_limb(frame):
    ids = np.arange(0, 900, 3, dtype=np.int32)
    bad, faces = np.arange(len(ids), dtype=np.int32), np.empty((len(ids), 2), np.int64)
    limb, skin = frame.projector.on_body.limb, frame.skin
    find_escape_faces(frame.points, frame.state.anchors, skin, ids, bad, limb, faces)
    for i, found in zip(ids, faces, strict=True):
        away = np.linalg.norm(skin.body - frame.points[i], axis=1)
        for face, among in zip(found, (np.arange(len(away)), own_vertices(frame, limb[i])), strict=True):
            assert np.isclose(away[skin.faces[face]], away[among].min(), rtol=1e-6).any()


def test_lift_keeps_order_and_joins_smoothly_at_the_margin():
    margin, gap = 0.0045, 0.0015
    distance = np.linspace(-0.06, margin, 4000)
    rise = np.array([lift_distance(each, margin, gap) for each in distance])
    assert (np.diff(rise) > 0).all()
    assert rise.min() > gap
    assert rise[-1] == pytest.approx(margin, abs=1e-12)
    assert (rise[-1] - rise[-2]) / (distance[-1] - distance[-2]) == pytest.approx(1, abs=0.01)


def test_lanes_stand_within_their_faces_where_the_scalar_function_says_to_the_last_bit():
    random, counts = np.random.default_rng(3), [0, 0]
    for _ in range(200):
        rows, stands = np.zeros((ROWS, LANES), np.float32), np.zeros(LANES, np.bool_)
        rows[:9] = random.normal(size=(9, LANES))
        corners = rows[:9].T.reshape(LANES, 3, 3).copy()
        project_lanes(rows, stands)
        for (a, b, c), stood, found in zip(corners, stands, rows[9:11].T, strict=True):
            s, t = nearest_weights(tuple(a), tuple(b), tuple(c))
            assert stood == (min(s, t) > 0 and 1 - s - t > 1e-6)
            assert not stood or tuple(found) == (s, t)
            counts[int(stood)] += 1
    assert min(counts) > 200


@pytest.mark.parametrize("held", [False, True])
def test_lanes_go_out_over_their_places_as_the_formula_says(held):
    margin, gap, random = 0.0045, 0.0015, np.random.default_rng(4)
    share = random.dirichlet(np.ones(3), LANES)
    corners = random.normal(scale=0.01, size=(LANES, 3, 3))
    normals = random.normal(size=(LANES, 1, 3)) + random.normal(scale=0.1, size=(LANES, 3, 3))
    normal = np.einsum("lc,lci->li", share, normals)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    place, height = np.einsum("lc,lci->li", share, corners), np.linspace(-0.01, 0.01, LANES)[:, None]
    point, offset = place + height * normal, np.full((LANES, 3), 0.001 * held)
    rows = np.zeros((ROWS, LANES), np.float32)
    rows[:9], rows[9:11], rows[11] = corners.reshape(LANES, 9).T, share[:, 1:].T, height[:, 0] ** 2
    rows[12:15], rows[15:18], rows[18:] = point.T, offset.T, normals.reshape(LANES, 9).T
    lift_lanes(rows, np.float32(margin), np.float32(gap), np.float32(1e-8))
    rise = np.maximum(lift_distance(np.minimum(height, margin), margin, gap) - height, 0)
    rise = np.maximum(rise, (offset * normal).sum(1, keepdims=True)) if held else rise
    expected = np.where(height < margin, point + rise * normal, point + offset)
    np.testing.assert_allclose(rows[12:15].T, expected, atol=1e-7)
    np.testing.assert_allclose(rows[11], height[:, 0], atol=1e-9)
