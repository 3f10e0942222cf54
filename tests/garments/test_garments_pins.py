"""Pins stay on the body however it moves."""

import numpy as np
import trimesh

from hemline.garments import Pins
from hemline.garments.dressing import body_tree
from hemline.meshes import vertex_normals


def pinned_on(shaped, count=300):
    rng = np.random.default_rng(0)
    x, y, _ = shaped.vertices.T
    torso = np.flatnonzero((np.abs(x) < 0.2) & (y > -0.05) & (y < 0.45))
    ids = rng.choice(torso, count, replace=False)
    positions = shaped.vertices[ids] + 0.004 * shaped.normals[ids]
    return Pins.bound(np.arange(count), positions, body_tree(shaped), shaped.normals), positions


def test_bound_pins_give_back_where_they_are(shaped):
    pins, positions = pinned_on(shaped)
    found = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces)
    error = np.linalg.norm(found - positions, axis=1)
    assert np.percentile(error, 98) < 1e-5 and error.max() < 1e-3 and np.median(np.abs(pins.heights - 0.004)) < 1e-4


def test_pins_move_rigidly_with_the_body(shaped):
    pins, _ = pinned_on(shaped)
    turn = np.array(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))[:3, :3]
    shift = np.array([0.3, -1.0, 2.0])
    before = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces)
    after = pins.positions(shaped.vertices @ turn.T + shift, shaped.normals @ turn.T, shaped.body.faces)
    np.testing.assert_allclose(after, before @ turn.T + shift, atol=2e-6)


def test_height_is_the_distance_from_the_surface_along_its_normal():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 0, -1.0]])
    faces = np.array([[0, 1, 2]], np.int32)
    normals = vertex_normals(vertices, faces)
    pins = Pins(np.array([0]), np.array([0]), np.array([[0.2, 0.3, 0.5]]), np.array([0.01]))
    np.testing.assert_allclose(pins.positions(vertices, normals, faces), [[0.3, 0.01, -0.5]])


def test_a_point_inside_is_raised_to_a_millimetre(shaped):
    inside = shaped.vertices[[100]] - 0.002 * shaped.normals[[100]]
    pins = Pins.bound(np.array([0]), inside, body_tree(shaped), shaped.normals)
    assert pins.heights[0] == np.float32(0.001) and len(pins) == 1
