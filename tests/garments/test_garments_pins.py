"""Pins stay on the body however it moves."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from hemline import garments, motions
from hemline.errors import BadGarment
from hemline.garments import Garment, Pins
from hemline.garments.dressing import body_tree
from hemline.meshes import vertex_normals
from hemline.motions.motion import JOINT_NAMES


def pinned_on(shaped, count=300):
    rng = np.random.default_rng(0)
    x, y, _ = shaped.vertices.T
    torso = np.flatnonzero((np.abs(x) < 0.2) & (y > -0.05) & (y < 0.45))
    ids = rng.choice(torso, count, replace=False)
    positions = shaped.vertices[ids] + 0.004 * shaped.normals[ids]
    return Pins.bind(np.arange(count), positions, body_tree(shaped), shaped.normals), positions


def test_bound_pins_give_back_where_they_are(shaped):
    pins, positions = pinned_on(shaped)
    found = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    error = np.linalg.norm(found - positions, axis=1)
    assert np.percentile(error, 98) < 1e-5 and error.max() < 1e-3 and np.median(np.abs(pins.heights - 0.004)) < 1e-4


def test_pins_move_rigidly_with_the_body(shaped):
    pins, _ = pinned_on(shaped)
    turn = np.array(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))[:3, :3]
    shift = np.array([0.3, -1.0, 2.0])
    faces, joints = shaped.body.faces, shaped.joints
    before = pins.positions(shaped.vertices, shaped.normals, faces, joints)
    after = pins.positions(shaped.vertices @ turn.T + shift, shaped.normals @ turn.T, faces, joints)
    np.testing.assert_allclose(after, before @ turn.T + shift, atol=2e-6)


def test_height_is_the_distance_from_the_surface_along_its_normal():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 0, -1.0]])
    faces = np.array([[0, 1, 2]], np.int32)
    normals = vertex_normals(vertices, faces)
    pins = Pins(np.array([0]), np.array([0]), np.array([[0.2, 0.3, 0.5]]), np.array([0.01]))
    np.testing.assert_allclose(pins.positions(vertices, normals, faces, np.zeros((24, 3))), [[0.3, 0.01, -0.5]])


def test_a_point_inside_is_raised_to_a_millimetre(shaped):
    inside = shaped.vertices[[100]] - 0.002 * shaped.normals[[100]]
    pins = Pins.bind(np.array([0]), inside, body_tree(shaped), shaped.normals)
    assert pins.heights[0] == np.float32(0.001) and len(pins) == 1


def hung(shaped, name="left_wrist", count=40):
    joint = JOINT_NAMES.index(name)
    positions = shaped.joints[joint] + 0.1 * np.random.default_rng(3).normal(size=(count, 3))
    return Pins.on_joint(np.arange(count), positions, joint, shaped.joints), positions


@pytest.mark.parametrize("name", ["pelvis", "left_wrist", "head"])
def test_pins_on_a_joint_follow_it_rigidly(shaped, name):
    pins, positions = hung(shaped, name)
    at_rest = pins.positions(shaped.vertices, shaped.normals, shaped.body.faces, shaped.joints)
    np.testing.assert_allclose(at_rest, positions, atol=1e-6)
    joint, motion = JOINT_NAMES.index(name), shaped.placed(motions.load("walk"))
    for frame in (0, 20, 40):
        posed = shaped.posed(motion[frame])
        transform = posed.transforms[joint].astype(np.float64)
        np.testing.assert_allclose(pins.on(posed), positions @ transform[:, :3].T + transform[:, 3], atol=2e-6)


def test_pins_on_a_joint_keep_their_offset_on_another_shape(shaped):
    pins, positions = hung(shaped)
    wide = shaped.body.shaped([2.0, -1.0])
    joint = JOINT_NAMES.index("left_wrist")
    found = pins.positions(wide.vertices, wide.normals, wide.body.faces, wide.joints)
    np.testing.assert_allclose(found - wide.joints[joint], positions - shaped.joints[joint], atol=1e-6)


def test_merged_pins_are_where_each_set_is(shaped):
    on_skin, on_joint = pinned_on(shaped, 20)[0].with_stiffness(200.0), hung(shaped, count=20)[0]
    both = Pins.concatenate([on_skin, replace(on_joint, vertices=np.arange(20, 40, dtype=np.int32))])
    posed = shaped.posed(shaped.placed(motions.load("kick"))[30])
    np.testing.assert_allclose(both.on(posed), np.concatenate([on_skin.on(posed), on_joint.on(posed)]), atol=1e-12)
    assert both.stiffness.tolist() == [200.0] * 20 + [np.inf] * 20


def test_soft_pins_and_pins_on_joints_come_back_from_disk(patch, shaped, tmp_path):
    pins = Pins.concatenate([replace(patch["pins"], stiffness=np.float32([150.0])), hung(shaped, count=1)[0]])
    garment = Garment(**patch | {"pins": pins})
    garment.save(tmp_path / "a.safetensors")
    again = Garment.load(tmp_path / "a.safetensors")
    assert again.hash == garment.hash != Garment(**patch).hash
    for name in ("vertices", "joints", "offsets", "stiffness"):
        np.testing.assert_array_equal(getattr(again.pins, name), getattr(pins, name))
    assert "2 pins, 4.0 to 4.0 mm above the skin, 1 on joints (left_wrist), 1 of them springs of 150" in (
        garments.explain(garment)
    )


@pytest.mark.parametrize("lost", ["pin_joints", "pin_offsets"])
def test_a_file_with_half_of_a_pin_on_a_joint_is_refused(patch, shaped, lost):
    pins = replace(hung(shaped, count=1)[0], vertices=np.array([1], np.int32))
    garment = Garment(**patch | {"pins": pins})
    arrays = {name: array for name, array in garment.arrays().items() if name != lost}
    with pytest.raises(BadGarment, match=f"no {lost}"):
        Garment.of(arrays, garment.metadata())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joints": np.array([24])}, "pins name a joint that does not exist; got 24; use 0 to 23"),
        ({"joints": np.array([-2])}, "pins name a joint that does not exist; got -2"),
        ({"stiffness": np.array([0.0])}, "pin stiffness must be positive; got 0.0; use infinity"),
        ({"stiffness": np.array([-np.inf])}, "pin stiffness must be finite"),
        ({"stiffness": np.array([np.nan])}, "pin stiffness must be finite"),
        ({"offsets": np.zeros((1, 2))}, r"pin offsets must have the shape \(1, 3\)"),
    ],
)
def test_pins_that_make_no_sense_are_refused(patch, change, message):
    with pytest.raises(BadGarment, match=message):
        Garment(**patch | {"pins": replace(patch["pins"], **change)})
