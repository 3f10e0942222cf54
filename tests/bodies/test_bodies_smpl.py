"""SMPL, SMPL-H and SMPL-X files give the bodies that SMPL's own formula says; contradictions are refused."""

import pickle
import sys
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.sparse import csr_matrix

from hemline import bodies
from hemline.errors import BadBody
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import from_axis_angle
from tests.bodies.body_samples import random_pose, t_pose
from tests.bodies.smpl_samples import as_published, small_arrays, smpl_vertices, write_pickle, write_published

JOINTS = {"SMPL": 24, "SMPL-H": 52, "SMPL-X": 55}


def npz(folder, arrays, name="model.npz"):
    np.savez(folder / name, joint2num=np.array({"a": 1}, dtype=object), **arrays)
    return folder / name


def both(body, arrays, seed, betas):
    """Vertices of the body, and those of SMPL's formula, in the same random shape and pose; fingers at rest."""
    random, count = np.random.default_rng(seed), len(arrays["J_regressor"])
    shape, trans = random.normal(size=betas), random.normal(size=3)
    turns = np.zeros((count, 3))
    turns[: 24 if count == 24 else 22] = random.normal(scale=0.5, size=(24 if count == 24 else 22, 3))
    pelvis = arrays["J_regressor"][0] @ (arrays["v_template"] + arrays["shapedirs"][:, :, :betas] @ shape)
    own = np.zeros((24, 3))
    own[:22], own[22:] = turns[:22], turns[22:24] if count == 24 else 0
    pose = Pose(from_axis_angle(own), pelvis + trans)
    return body.shaped(shape).posed(pose), smpl_vertices(arrays, shape, turns, trans)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("joints", JOINTS.values(), ids=JOINTS.keys())
def test_a_pickle_moves_as_the_formula_says(joints, seed, tmp_path):
    arrays = small_arrays(joints, seed=seed)
    posed, truth = both(bodies.read(write_published(tmp_path / "model.pkl", arrays)), arrays, seed, 10)
    assert np.abs(posed.vertices - truth).max() < 1e-5


@pytest.mark.parametrize("joints", JOINTS.values(), ids=JOINTS.keys())
def test_an_npz_moves_as_the_formula_says(joints, tmp_path):
    arrays = small_arrays(joints, betas=16 if joints < 55 else 400)
    posed, truth = both(bodies.read(npz(tmp_path, arrays)), arrays, 5, 16)
    assert np.abs(posed.vertices - truth).max() < 1e-5


def test_without_pose_dependent_offsets(tmp_path):
    arrays = small_arrays()
    del arrays["posedirs"]
    body = bodies.read(npz(tmp_path, arrays))
    assert body.posedirs is None
    posed, truth = both(body, arrays | {"posedirs": np.zeros((90, 3, 207))}, 1, 10)
    assert np.abs(posed.vertices - truth).max() < 1e-5


def test_the_t_pose_is_the_rest_pose_and_the_pelvis_stays_at_the_origin(tmp_path):
    body = bodies.read(npz(tmp_path, small_arrays()))
    assert np.array_equal(body.rest_offsets, t_pose().rotations)
    shaped = body.shaped(np.random.default_rng(0).normal(size=10))
    assert np.abs(shaped.joints[0]).max() < 1e-7
    assert np.abs(shaped.posed(t_pose()).vertices - shaped.vertices).max() < 1e-6


@pytest.mark.parametrize(
    "joints, betas, kept",
    [(24, 10, 10), (24, 300, 16), (52, 16, 16), (55, 20, 10), (55, 400, 16), (24, 4, 4)],
)
def test_as_many_shape_coefficients_as_are_of_the_shape(joints, betas, kept, tmp_path):
    assert len(bodies.read(npz(tmp_path, small_arrays(joints, betas=betas))).shapedirs) == kept


@pytest.mark.parametrize("joints, first", [(52, 22), (55, 25)])
def test_fingers_become_hands_thumbs_wrists_and_faces_heads(joints, first, tmp_path):
    arrays = small_arrays(joints, verts=joints)
    arrays["weights"] = np.eye(joints)
    body = bodies.read(npz(tmp_path, arrays))
    names = [JOINT_NAMES[joint] for joint in body.weight_indices[:, 0]]
    assert names[:22] == list(JOINT_NAMES[:22]) and names[22:first] == ["head"] * (first - 22)
    assert names[first:] == [*["left_hand"] * 12, *["left_wrist"] * 3, *["right_hand"] * 12, *["right_wrist"] * 3]
    pivots = (arrays["J_regressor"] @ arrays["v_template"])[[0, first + 3, first + 18]]  # the middle fingers' first
    assert np.abs(body.joints[22:] - (pivots[1:] - pivots[0])).max() < 1e-6
    assert not body.posedirs[9 * 21 :].any() and body.posedirs[: 9 * 21].all()


def test_holes_are_closed_by_triangles_after_the_others(tmp_path):
    ball, arrays = trimesh.creation.icosphere(subdivisions=2), small_arrays(55, verts=162)
    first, second = (np.linalg.norm(ball.triangles_center - at, axis=1) < 0.5 for at in ([0, 0.2, 1], [0, 1, -0.3]))
    arrays |= {"v_template": ball.vertices, "f": np.asarray(ball.faces)[~(first | second)]}
    body = bodies.read(npz(tmp_path, arrays))
    assert np.array_equal(body.faces[: len(arrays["f"])], arrays["f"])
    mesh = trimesh.Trimesh(ball.vertices, body.faces, process=False)
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.euler_number == 2
    assert 0.8 * ball.volume < mesh.volume < ball.volume
    whole = arrays | {"f": np.asarray(ball.faces)}
    assert np.array_equal(bodies.read(npz(tmp_path, whole)).faces, ball.faces)


def test_holes_that_touch_are_left(tmp_path):
    arrays = small_arrays() | {"f": np.array([[0, 1, 2], [0, 3, 4]])}
    assert np.array_equal(bodies.read(npz(tmp_path, arrays)).faces, arrays["f"])


def test_the_six_largest_weights_are_kept_and_sum_to_one(tmp_path):
    arrays = small_arrays()
    arrays["weights"] = np.random.default_rng(0).dirichlet(np.ones(24), size=90)
    body = bodies.read(npz(tmp_path, arrays))
    largest = -np.sort(-arrays["weights"], axis=1)[:, :6]
    assert np.abs(body.weights - largest / largest.sum(axis=1, keepdims=True)).max() < 1e-6
    cut = arrays | {"weights": np.where(arrays["weights"] >= largest[:, 5:], arrays["weights"], 0)}
    cut["weights"] = cut["weights"] / cut["weights"].sum(axis=1, keepdims=True)
    posed, truth = both(body, cut, 2, 10)
    assert np.abs(posed.vertices - truth).max() < 1e-5


@pytest.mark.parametrize("protocol", range(6))
def test_pickles_of_every_protocol_hold_the_same_body(protocol, tmp_path):
    arrays = small_arrays()
    plain = bodies.read(npz(tmp_path, arrays))
    again = bodies.read(write_pickle(tmp_path / "model.pkl", as_published(arrays), protocol))
    assert np.array_equal(again.template, plain.template) and np.array_equal(again.weights, plain.weights)
    assert np.array_equal(again.posedirs, plain.posedirs) and np.array_equal(again.shapedirs, plain.shapedirs)
    assert np.abs(again.joints - plain.joints).max() < 1e-7


def test_a_regressor_by_rows_and_numbers_in_another_byte_order(tmp_path):
    arrays = small_arrays()
    content = arrays | {"J_regressor": csr_matrix(arrays["J_regressor"]), "weights": arrays["weights"].astype(">f4")}
    body, plain = bodies.read(write_pickle(tmp_path / "a.pkl", content)), bodies.read(npz(tmp_path, arrays))
    assert np.abs(body.joints - plain.joints).max() < 1e-7 and np.abs(body.weights - plain.weights).max() < 1e-6


def test_reading_needs_no_chumpy(tmp_path):
    bodies.read(write_published(tmp_path / "model.pkl", small_arrays()))
    assert not any(name.split(".")[0] == "chumpy" for name in sys.modules)


def test_name_and_terms(tmp_path):
    for name, joints in JOINTS.items():
        body = bodies.read(npz(tmp_path, small_arrays(joints), "basic_f.npz"))
        assert body.name == "basic_f"
        assert body.licence.startswith(f"{name} (") and "non-commercial" in body.licence


def test_converted_once_it_is_the_same_body(tmp_path):
    body = bodies.read(write_published(tmp_path / "basic_f.pkl", small_arrays()))
    bodies.write(tmp_path / "smpl.safetensors", body)
    again = bodies.read(tmp_path / "smpl.safetensors")
    assert (again.name, again.licence) == (body.name, body.licence)
    pose = random_pose(3, 0.6)
    apart = again.shaped([1.0, -1.0]).posed(pose).vertices - body.shaped([1.0, -1.0]).posed(pose).vertices
    assert np.abs(apart).max() < 2e-5
    assert np.abs(again.posedirs - body.posedirs).max() <= 0.51 * np.abs(body.posedirs).max() / 32767
    bodies.write(tmp_path / "again.safetensors", again)
    assert bodies.read(tmp_path / "again.safetensors").hash == again.hash
    assert (
        len({each.hash for each in (again, replace(again, posedirs=None), replace(again, posedirs=-again.posedirs))})
        == 3
    )


def test_a_body_is_loaded_by_its_path_and_called_so(tmp_path):
    path = npz(tmp_path, small_arrays())
    assert bodies.load(str(path)).name == str(path) and bodies.load(str(path)) is bodies.load(str(path))
    assert bodies.load(str(path)).hash == bodies.read(path).hash
    with pytest.raises(BadBody, match=r"cannot read .*no.pkl; got No such file"):
        bodies.load(str(tmp_path / "no.pkl"))


WRONG = {
    "joints": (
        {"weights": np.full((90, 23), 1 / 23)},
        r"weights must be those of a known number of joints.*\(90, 23\)",
    ),
    "scalar": ({"weights": np.float64(1)}, "weights must be those of a known number of joints"),
    "template": ({"v_template": np.zeros((90, 2))}, r"'v_template' must have shape \(90, 3\); got \(90, 2\)"),
    "posedirs": ({"posedirs": np.zeros((90, 3, 459))}, r"'posedirs' must have shape \(90, 3, 207\)"),
    "regressor": ({"J_regressor": np.zeros((24, 89))}, r"'J_regressor' must have shape \(24, 90\)"),
    "kind": ({"f": np.zeros((4, 3))}, "'f' must hold whole numbers; got float64"),
    "nan": ({"weights": np.full((90, 24), np.nan)}, "'weights' must hold numbers below 1e.06; got nan"),
    "infinite": ({"shapedirs": np.full((90, 3, 10), np.inf)}, "'shapedirs' must hold numbers below .*; got 0..inf"),
    "huge": ({"v_template": np.full((90, 3), -1e300)}, "'v_template' must hold numbers below .*; got -1e.300"),
    "sums": ({"weights": np.full((90, 24), 0.1)}, "'weights' of a vertex must sum to 1, none below 0; got sums 2.4"),
    "negative": ({"weights": np.eye(24)[np.zeros(90, int)] * 2 - np.eye(24)[np.ones(90, int)]}, "none below 0"),
    "face": ({"f": np.array([[0, 1, 90]])}, r"'f' must lie in 0\.\.89; got 0\.\.90"),
    "no faces": ({"f": np.zeros((0, 3), np.int64)}, r"'f' must lie in 0\.\.89; got no triangles"),
}


@pytest.mark.parametrize("change, message", WRONG.values(), ids=WRONG.keys())
@pytest.mark.parametrize("ending", ["npz", "pkl"])
def test_contradictions(change, message, ending, tmp_path):
    arrays = small_arrays() | {name: np.asarray(array) for name, array in change.items()}
    path = npz(tmp_path, arrays) if ending == "npz" else write_pickle(tmp_path / "a.pkl", arrays)
    with pytest.raises(BadBody, match=message):
        bodies.read(path)


@pytest.mark.parametrize("change", [{4: 7}, {7: 4, 4: 7}, {3: 3}, {23: 20}, {0: 1}], ids=str)
def test_a_skeleton_that_is_another_or_a_ring(change, tmp_path):
    arrays = small_arrays()
    for joint, parent in change.items():
        arrays["kintree_table"][0, joint] = parent
    with pytest.raises(BadBody, match="'kintree_table' must be that of SMPL"):
        bodies.read(npz(tmp_path, arrays))


@pytest.mark.parametrize("name", ["v_template", "shapedirs", "weights", "kintree_table", "f", "J_regressor"])
def test_lacking_a_key(name, tmp_path):
    arrays = small_arrays()
    del arrays[name]
    for path in (npz(tmp_path, arrays), write_pickle(tmp_path / "a.pkl", arrays)):
        with pytest.raises(BadBody, match=f"lacks arrays of an SMPL model; got {name}"):
            bodies.read(path)


def test_an_ending_that_lies(tmp_path):
    zipped = npz(tmp_path, small_arrays()).read_bytes()
    files = {"a.pkl": zipped, "a.npz": pickle.dumps(small_arrays(), 2), "b.npz": b"", "b.pkl": b""}
    said = [
        "must be a pickle, as its ending says; got a zip",
        "must be a zip archive",
        "an empty file",
        "an empty file",
    ]
    for (name, content), match in zip(files.items(), said, strict=True):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(BadBody, match=match):
            bodies.read(tmp_path / name)
