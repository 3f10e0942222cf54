"""Shape and pose: laws, the T-pose, and agreement with the library that the body comes from."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies
from hemline.errors import BadBody
from hemline.files import read_tensors
from hemline.meshes import vertex_normals
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import multiply
from tests.bodies.body_samples import random_pose, t_pose

ROTATED = Rotation.from_rotvec([0.4, -1.1, 0.7])
SHIFT = np.array([3.0, -1.0, 2.0])


@pytest.fixture(scope="module")
def shaped():
    return bodies.load().shaped([0.7, -1.2, 0.5])


def joint(posed, name):
    return posed.joints[JOINT_NAMES.index(name)]


def test_shaping_is_linear():
    body, rng = bodies.load(), np.random.default_rng(0)
    first, second = rng.normal(size=(2, 16)).astype(np.float32)
    both = body.shaped(first + second)
    for field, mean in (("vertices", body.template), ("joints", body.joints)):
        summed = getattr(body.shaped(first), field) + getattr(body.shaped(second), field) - mean
        np.testing.assert_allclose(getattr(both, field), summed, atol=2e-6)


def test_missing_betas_are_zero():
    body = bodies.load()
    assert np.array_equal(body.shaped().vertices, body.template)
    assert np.array_equal(body.shaped([0.5]).vertices, body.shaped([0.5] + 15 * [0]).vertices)


@pytest.mark.parametrize(
    "betas, message",
    [
        ([0.0] * 17, "has 16 betas"),
        (0.5, "has 16 betas"),
        ([[0.5]], "has 16 betas"),
        ([np.nan], "betas must be finite"),
        ([np.inf], "betas must be finite"),
        ([0.0, -20.5], "betas must be from -20 to 20; got .*-20.5"),
        (["tall"], "betas must be numbers"),
    ],
)
def test_bad_betas(betas, message):
    with pytest.raises(BadBody, match=message):
        bodies.load().shaped(betas)


def test_rest_pose_gives_the_mesh_at_rest(shaped):
    posed = shaped.posed(shaped.rest_pose)
    np.testing.assert_allclose(posed.vertices, shaped.vertices, atol=1e-6)
    np.testing.assert_allclose(posed.joints, shaped.joints, atol=1e-6)


def test_identity_is_a_t_pose():
    posed = bodies.load().shaped().posed(t_pose())
    for side, sign in (("left", 1), ("right", -1)):
        arm = [joint(posed, f"{side}_{name}") for name in ("shoulder", "elbow", "wrist", "hand")]
        for bone in np.diff(arm, axis=0):
            assert np.dot(bone, [sign, 0, 0]) / np.linalg.norm(bone) > 1 - 1e-6
        hip, knee, ankle = (joint(posed, f"{side}_{name}") for name in ("hip", "knee", "ankle"))
        assert abs(knee[0] - hip[0]) < 1e-5 and abs(ankle[0] - knee[0]) < 0.01
        for bone in (knee - hip, ankle - knee):
            assert -bone[1] / np.linalg.norm(bone) > np.cos(np.deg2rad(6))
        foot = joint(posed, f"{side}_foot") - joint(posed, f"{side}_ankle")
        assert foot[2] > 0.1 and abs(foot[0]) < 0.01


def test_palms_look_down_in_the_t_pose():
    body = bodies.load()
    posed = body.shaped().posed(t_pose())
    for name in ("left_hand", "right_hand"):
        held = (body.weight_indices[:, 0] == JOINT_NAMES.index(name)) & (body.weights[:, 0] > 0.9)
        hand = posed.vertices[held] - posed.vertices[held].mean(axis=0)
        spread = np.linalg.eigh(hand.T @ hand)[1]
        assert abs(spread[1, 0]) > 0.85  # the hand is thinnest from above


def test_rigid_motion_of_the_pose_moves_the_mesh_rigidly(shaped):
    pose = random_pose(3)
    w_last = ROTATED.as_quat()
    rotations = pose.rotations.copy()
    rotations[0] = multiply(w_last[[3, 0, 1, 2]], rotations[0])
    moved = shaped.posed(Pose(rotations, ROTATED.apply(pose.translation) + SHIFT))
    still = shaped.posed(pose)
    for field in ("vertices", "joints"):
        np.testing.assert_allclose(getattr(moved, field), ROTATED.apply(getattr(still, field)) + SHIFT, atol=5e-6)
    for field in ("normals", "skinned_normals"):
        np.testing.assert_allclose(getattr(moved, field), ROTATED.apply(getattr(still, field)), atol=2e-3)


def test_bones_keep_their_lengths(shaped):
    parents = shaped.body.parents
    lengths = [
        np.linalg.norm(p[1:] - p[parents[1:]], axis=1) for p in (shaped.joints, shaped.joints_at(random_pose(1)))
    ]
    np.testing.assert_allclose(lengths[1], lengths[0], rtol=1e-5)


def test_posed_vertices_agree_with_anny():
    """Vertices that `anny` 0.6.2 posed with its own 53 bones, four shapes, random poses (written by the bake)."""
    reference, _ = read_tensors(Path(__file__).parent / "anny_reference.safetensors", "body reference")
    ids = reference["vertex_ids"]
    for betas, rotations, translation, vertices in zip(
        reference["betas"], reference["rotations"], reference["translations"], reference["vertices"], strict=True
    ):
        posed = bodies.load().shaped(betas).posed(Pose(rotations, translation))
        # float32, and shapedirs rounded to int16
        np.testing.assert_allclose(posed.vertices[ids], vertices, atol=5e-6)


def test_normals_are_those_of_the_posed_mesh(shaped):
    posed = shaped.posed(random_pose(5))
    twin = vertex_normals(posed.vertices.astype(np.float64), posed.faces)
    assert np.einsum("vc,vc->v", posed.normals, twin).min() > 0.999
    np.testing.assert_allclose(np.linalg.norm(posed.normals, axis=1), 1, atol=1e-5)


def test_skinned_normals_agree_with_true_ones_away_from_creases(shaped):
    rest = shaped.posed(shaped.rest_pose)
    np.testing.assert_allclose(rest.skinned_normals, shaped.normals, atol=1e-5)
    posed = shaped.posed(random_pose(5))
    cosines = np.einsum("vc,vc->v", posed.normals, posed.skinned_normals)
    assert np.median(cosines) > 0.9999 and np.percentile(cosines, 2) > 0.8


def test_the_mesh_is_made_once(shaped):
    posed = shaped.posed(random_pose(2))
    assert posed.vertices is posed.vertices and posed.normals is posed.normals
    assert posed.vertices.dtype == np.float32 and posed.vertices.flags.c_contiguous
    assert posed.faces is shaped.body.faces


def test_leg_length_is_hip_to_knee_to_ankle():
    shaped = bodies.load().shaped()
    hip, knee, ankle = (shaped.joints[JOINT_NAMES.index(f"left_{name}")] for name in ("hip", "knee", "ankle"))
    assert shaped.leg_length == pytest.approx(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle), rel=1e-3)
