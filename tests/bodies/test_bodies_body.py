"""The body that ships, and what a body may be."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import hemline
from hemline import bodies
from hemline.bodies.place import sole_vertices
from hemline.errors import BadBody
from hemline.motions import JOINT_NAMES, PARENTS


@pytest.fixture(scope="module")
def body():
    return bodies.load("anny24")


def test_anny24_has_the_promised_size(body):
    assert body.template.shape == (13348, 3) and body.faces.shape == (26692, 3)
    assert body.shapedirs.shape == (16, 13348, 3) and body.joints.shape == (24, 3)
    assert body.parents.tolist() == list(PARENTS)
    assert np.array_equal(body.joints[0], np.zeros(3))


def test_mesh_is_one_watertight_solid(body):
    mesh = trimesh.Trimesh(body.template, body.faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.body_count == 1
    assert mesh.euler_number == 2
    assert 0.05 < mesh.volume < 0.1  # a person; positive: the normals point outward


def test_it_faces_z_stands_along_y_and_left_is_x(body):
    head, foot, ankle = (body.joints[JOINT_NAMES.index(name)] for name in ("head", "left_foot", "left_ankle"))
    assert head[1] > 0.5 and foot[1] < -0.7
    assert foot[2] > ankle[2] + 0.05 and foot[0] > 0.05
    assert np.abs(body.template[:, 0].mean()) < 1e-3


def test_weights_sum_to_one_strongest_first(body):
    assert np.abs(body.weights.sum(axis=1) - 1).max() < 1e-6
    assert (np.diff(body.weights, axis=1) <= 0).all() and body.weights.min() == 0


def test_first_beta_is_stature_and_grows(body):
    heights = [np.ptp(body.shaped([beta]).vertices[:, 1]) for beta in (-1, 0, 1)]
    assert np.diff(heights) == pytest.approx([0.146, 0.146], abs=0.01)
    taller = [np.ptp(body.template[:, 1] + change[:, 1]) - heights[1] for change in body.shapedirs]
    assert int(np.argmax(np.abs(taller))) == 0


def test_betas_are_uncorrelated_directions_of_falling_size(body):
    flat = body.shapedirs.reshape(16, -1).astype(np.float64)
    sizes = np.linalg.norm(flat, axis=1)
    products = flat @ flat.T / np.outer(sizes, sizes)
    assert np.abs(products - np.eye(16)).max() < 1e-3
    assert (np.diff(sizes) < 0).all()


def test_hash_depends_on_content_only(body):
    assert replace(body, name="other", licence="").hash == body.hash
    assert replace(body, template=body.template + 1).hash != body.hash


def test_hash_of_the_body_that_ships_is_that_of_the_models_that_ship(body):
    assert hemline.load("cape").body_hash == body.hash


def test_loading_again_gives_the_same_object():
    assert bodies.load("anny24") is bodies.load("anny24") and bodies.names() == ("anny24",)


def test_unknown_name_is_answered_with_the_nearest():
    with pytest.raises(BadBody, match="nearest name is 'anny24'"):
        bodies.load("any")


def test_soles_are_under_both_feet(body):
    shaped = body.shaped()
    soles = shaped.vertices[sole_vertices(shaped)]
    assert (soles[:, 0] > 0.05).any() and (soles[:, 0] < -0.05).any()
    assert soles[:, 1].min() == shaped.vertices[:, 1].min()


BROKEN = {
    "shape": ({"joints": np.zeros((23, 3))}, r"'joints' must have shape \(24, 3\)"),
    "nan": ({"template": np.full((13348, 3), np.nan)}, "'template' must be finite"),
    "face": ({"faces": np.array([[0, 1, 13348]])}, r"'faces' must lie in 0\.\.13347"),
    "no faces": ({"faces": np.zeros((0, 3))}, "there must be vertices and faces"),
    "joint": ({"weight_indices": np.full((13348, 6), 24)}, r"'weight_indices' must lie in 0\.\.23"),
    "weights": ({"weights": np.full((13348, 6), 0.5)}, "weights of a vertex must sum to 1"),
    "parents": ({"parents": np.array([-1, 2, *PARENTS[2:]])}, "each parent must come before its child"),
    "root": ({"parents": np.array([-1, -1, *PARENTS[2:]])}, "each parent must come before its child"),
    "posedirs": ({"posedirs": np.zeros((216, 13348, 3), np.float32)}, r"'posedirs' must have shape \(207, 13348, 3\)"),
    "offsets": ({"rest_offsets": np.ones((24, 4))}, "'rest_offsets' must be unit"),
}


@pytest.mark.parametrize("change, message", BROKEN.values(), ids=BROKEN.keys())
def test_contradictions_are_refused(body, change, message):
    with pytest.raises(BadBody, match=message):
        replace(body, **change)
