"""Kernels against plain NumPy, and linear against dual-quaternion blending."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies
from hemline.bodies import skin_points
from hemline.motions import JOINT_NAMES, Pose
from hemline.motions.quaternions import multiply
from tests.bodies.body_samples import random_pose, t_pose, turned


@pytest.fixture(scope="module")
def shaped():
    return bodies.load().shaped([0.3, 1.0])


def transforms_by_scipy(shaped, pose):
    """Forward kinematics, joint by joint, as the design page writes it."""
    body = shaped.body
    local = Rotation.from_quat(pose.rotations[:, [1, 2, 3, 0]])
    offsets = Rotation.from_quat(body.rest_offsets[:, [1, 2, 3, 0]])
    rest = shaped.joints.astype(np.float64)
    turns, at, transforms = [], [], np.empty((24, 3, 4))
    for joint, parent in enumerate(body.parents):
        if parent < 0:
            turns.append(local[joint])
            at.append(pose.translation.astype(np.float64))
        else:
            turns.append(turns[parent] * local[joint])
            at.append(at[parent] + (turns[parent] * offsets[parent]).apply(rest[joint] - rest[parent]))
        matrix = (turns[joint] * offsets[joint]).as_matrix()
        transforms[joint] = np.column_stack([matrix, at[joint] - matrix @ rest[joint]])
    return transforms, np.array(at)


def linear_twin(transforms, indices, weights, points):
    blended = np.einsum("vi,virc->vrc", weights.astype(np.float64), transforms.astype(np.float64)[indices])
    return np.einsum("vrc,vc->vr", blended[:, :, :3], points) + blended[:, :, 3]


def dual_twin(transforms, indices, weights, points):
    """Dual-quaternion blending by scipy's rotations."""
    turns = Rotation.from_matrix(transforms[:, :, :3].astype(np.float64)).as_quat()
    shifts = np.concatenate([transforms[:, :, 3].astype(np.float64), np.zeros((24, 1))], axis=1)

    def times(a, b):
        real = a[:, 3:] * b[:, :3] + b[:, 3:] * a[:, :3] + np.cross(a[:, :3], b[:, :3])
        return np.column_stack([real, a[:, 3] * b[:, 3] - np.einsum("jc,jc->j", a[:, :3], b[:, :3])])

    duals = 0.5 * times(shifts, turns)
    signs = np.sign(np.einsum("vic,vc->vi", turns[indices], turns[indices[:, 0]]))
    shares = weights * signs
    real, dual = (np.einsum("vi,vic->vc", shares, each[indices]) for each in (turns, duals))
    length = np.linalg.norm(real, axis=1, keepdims=True)
    real, dual = real / length, dual / length
    shift = 2 * times(dual, real * [-1, -1, -1, 1])[:, :3]
    return Rotation.from_quat(real).apply(points) + shift


@pytest.mark.parametrize("seed", range(3))
def test_forward_kinematics_twin(shaped, seed):
    pose = random_pose(seed, scale=1.0)
    transforms, joints = transforms_by_scipy(shaped, pose)
    posed = shaped.posed(pose)
    np.testing.assert_allclose(posed.transforms, transforms, atol=1e-6)
    np.testing.assert_allclose(posed.joints, joints, atol=1e-6)
    assert np.array_equal(shaped.joints_at(pose), posed.joints)


@pytest.mark.parametrize("blending, twin", [("linear", linear_twin), ("dual", dual_twin)])
def test_skinning_twin(shaped, blending, twin):
    body, posed = shaped.body, shaped.posed(random_pose(7, scale=0.8), blending=blending)
    expected = twin(posed.transforms, body.weight_indices, body.weights, shaped.vertices)
    np.testing.assert_allclose(posed.vertices, expected, atol=5e-6)


def test_blendings_agree_for_small_angles_from_rest(shaped):
    differences = []
    for scale in (0.01, 0.1):
        rest = shaped.rest_pose
        pose = Pose(multiply(random_pose(4, scale=scale).rotations, rest.rotations), rest.translation)
        linear, dual = (shaped.posed(pose, blending=how).vertices for how in ("linear", "dual"))
        differences.append(np.abs(linear - dual).max())
    assert differences[0] < 1e-4
    assert differences[0] < differences[1] / 20  # second order in the angle


def test_dual_quaternions_keep_a_twisted_wrist_wide(shaped):
    pose = turned(t_pose(), left_wrist=(2.6, 0, 0))
    wrist = shaped.joints_at(pose)[JOINT_NAMES.index("left_wrist")]
    radii = {}
    for how in ("linear", "dual"):
        vertices = shaped.posed(pose, blending=how).vertices
        ring = np.abs(vertices[:, 0] - wrist[0]) < 0.01
        radii[how] = np.linalg.norm((vertices[ring] - vertices[ring].mean(axis=0))[:, 1:], axis=1).mean()
    assert radii["linear"] < 0.8 * radii["dual"]


def test_points_of_any_number_of_influences():
    transforms = np.tile(np.eye(3, 4, dtype=np.float32), (24, 1, 1))
    transforms[5, :, 3] = [1, 2, 3]
    indices, weights = np.array([[0, 5]], np.int32), np.array([[0.75, 0.25]], np.float32)
    for blending in ("linear", "dual"):
        moved = skin_points(transforms, indices, weights, np.zeros((1, 3), np.float32), blending=blending)
        np.testing.assert_allclose(moved, [[0.25, 0.5, 0.75]], atol=1e-6)


def test_half_turns_in_every_direction_are_dual_quaternions(shaped):
    """The four branches that make a quaternion of a matrix."""
    body = shaped.body
    for axis in np.vstack([np.eye(3), [[0.6, 0.8, 0.0]], [[0, 0.6, 0.8]]]):
        pose = turned(t_pose(), pelvis=tuple(np.pi * axis))
        posed = shaped.posed(pose, blending="dual")
        expected = dual_twin(posed.transforms, body.weight_indices, body.weights, shaped.vertices)
        np.testing.assert_allclose(posed.vertices, expected, atol=5e-6)
