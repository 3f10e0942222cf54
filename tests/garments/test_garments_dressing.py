"""The same garment on another shape: pins on the skin, cloth outside, cut unchanged."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.errors import BadGarment
from hemline.garments.clearance import push_out_of_body, smooth_field
from hemline.garments.dressing import body_tree
from hemline.meshes import edge_strains


@pytest.mark.parametrize("seed", range(3))
def test_on_another_shape(seed):
    shaped = bodies.load("anny24").shaped(np.random.default_rng(seed).normal(size=16) * 1.2)
    cape = garments.load("cape-light")
    worn = cape.dressed(shaped)
    assert body_tree(shaped).signed_distances(worn.vertices).min() > 0.0029
    on_skin = worn.pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    np.testing.assert_allclose(worn.vertices[worn.pins.vertices], on_skin, atol=1e-6)
    np.testing.assert_array_equal(worn.rest_edges, cape.rest_edges)
    np.testing.assert_array_equal(worn.body_betas, shaped.betas)
    assert np.percentile(np.abs(edge_strains(worn.vertices, worn.faces, worn.rest_edges)), 99) < 0.25


def test_on_its_own_shape_it_stays(shaped):
    cape = garments.load("cape-light")
    np.testing.assert_allclose(cape.dressed(shaped).vertices, cape.vertices, atol=2e-5)


def test_there_and_back_again(shaped):
    cape = garments.load("cape-light")
    other = bodies.load("anny24").shaped([0.5, -0.5])
    back = cape.dressed(other).dressed(shaped)
    assert np.linalg.norm(back.vertices - cape.vertices, axis=1).mean() < 0.006


def test_refuses_another_body(shaped):
    stranger = replace(garments.load("cape-light"), body_name="smpl")
    with pytest.raises(BadGarment, match="was made on smpl; got a body called anny24"):
        stranger.dressed(shaped)


def test_cleared_points_are_outside_and_others_stay(shaped):
    tree = body_tree(shaped)
    rng = np.random.default_rng(0)
    ids = rng.choice(len(shaped.vertices), 500, replace=False)
    points = shaped.vertices[ids] + rng.uniform(-0.01, 0.02, (500, 1)) * shaped.normals[ids]
    before = tree.signed_distances(points)
    after = push_out_of_body(points, tree, 0.003)
    distance = tree.signed_distances(after)
    assert (distance > 0).all() and (distance > 0.00299).mean() > 0.97
    np.testing.assert_array_equal(after[before > 0.0031], points[before > 0.0031])
    held = push_out_of_body(points, tree, 0.003, fixed=np.ones(500, bool))
    np.testing.assert_array_equal(held, points.astype(np.float64))


def test_a_smooth_field_keeps_constants_and_spreads_trusted_values():
    faces = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]])
    constant = np.tile([1.0, 2.0, 3.0], (5, 1))
    np.testing.assert_allclose(smooth_field(constant, faces, np.ones(5), 2.0), constant, atol=1e-6)
    trust = np.array([1e6, 0, 0, 0, 1e6])
    field = np.zeros((5, 3))
    field[4] = 1
    found = smooth_field(field, faces, trust, 1.0)[:, 0]
    # harmonic between the two trusted ends of this graph: 0-1, 0-2, 1-2, 1-3, 2-3, 2-4, 3-4
    np.testing.assert_allclose(found, [0, 3 / 8, 1 / 2, 5 / 8, 1], atol=1e-5)
