"""The distance between bodies under a garment, compared with an independent matrix power, and its invariances."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import fractional_matrix_power

from hemline import bodies, garments
from hemline.animators.agentdress.binding import Binding
from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.fit.shape_distance import shape_scale
from tests.animators import formula_garment as made


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24")


@pytest.fixture(scope="module")
def nearest(body):
    """Returns the closest body vertices of the T-shirt of 3,150 vertices."""
    garment, shaped = garments.load("tshirt-light"), body.shaped()
    return Binding.of(garment.vertices, garment.faces, shaped.posed(shaped.rest_pose)).nearest


def scale_of(body, nearest, shapedirs):
    """Returns the scale of a body with other effects of betas."""
    return shape_scale(replace(body, shapedirs=shapedirs.astype(np.float32)).shaped(), nearest)


def test_scale_is_a_power_of_the_skin_motion_by_betas(body, nearest):
    normals, moved = body.shaped().normals, np.zeros((16, 16))
    for vertex in nearest:
        out = [float(np.dot(direction[vertex], normals[vertex])) for direction in body.shapedirs.astype(np.float64)]
        moved += np.outer(out, out)
    expected, scale = fractional_matrix_power(moved, 0.75), shape_scale(body.shaped(), nearest)
    np.testing.assert_allclose(scale @ scale, 16 * expected / np.trace(expected), atol=1e-4)
    np.testing.assert_allclose(scale, scale.T, atol=1e-9)


def test_bodies_that_differ_elsewhere_have_distance_zero(body, nearest):
    """One beta moves the skin elsewhere, and two betas cancel."""
    shapedirs = body.shapedirs.copy()
    shapedirs[3, nearest] = 0
    shapedirs[6] = -shapedirs[5]
    scale = scale_of(body, nearest, shapedirs)
    apart = np.linalg.norm(scale @ np.eye(16)[[3, 5, 6]].T, axis=0)
    assert apart[0] < 1e-3 * apart[1]
    assert np.linalg.norm(scale @ (np.eye(16)[5] + np.eye(16)[6])) < 1e-3 * apart[1]


def test_distances_do_not_depend_on_the_axes_of_betas(body, nearest):
    random = np.random.default_rng(0)
    turn = np.linalg.qr(random.normal(size=(16, 16)))[0]
    turned = scale_of(body, nearest, np.tensordot(turn, body.shapedirs.astype(np.float64), 1))
    scale = shape_scale(body.shaped(), nearest)
    for betas in random.normal(size=(5, 16)):
        assert np.linalg.norm(turned @ turn @ betas) == pytest.approx(np.linalg.norm(scale @ betas), rel=1e-3)


def test_betas_count_alike_if_none_moves_the_skin(body, nearest):
    shapedirs = body.shapedirs.copy()
    shapedirs[:, nearest] = 0
    np.testing.assert_array_equal(scale_of(body, nearest, shapedirs), np.eye(16))


@pytest.mark.parametrize("given", [None, np.diag(np.arange(16.0))])
def test_a_fit_uses_this_scale_by_default(tmp_path, given):
    anchors = AnchorSet.of(made.make_dataset(tmp_path / "anchors", 4))
    model = fit_anchors(made.shirt(), anchors, AgentDressConfig(), scale=given, progress=lambda *told: None)
    expected = shape_scale(made.body(), model.tables.nearest) if given is None else given
    np.testing.assert_allclose(model.tables.shapes.scale, expected, atol=1e-6)
