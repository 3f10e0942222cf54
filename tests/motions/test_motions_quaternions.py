import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from hemline.motions import quaternions as ours
from tests.motions.bvh_samples import quaternions


@pytest.fixture
def pairs():
    return Rotation.random(200, rng=np.random.default_rng(1)), Rotation.random(200, rng=np.random.default_rng(2))


def same(first, second, tolerance=1e-12):
    """Equal up to sign, since q and -q turn alike."""
    return np.minimum(np.abs(first - second).max(-1), np.abs(first + second).max(-1)).max() < tolerance


def test_product_inverse_and_matrix_agree_with_scipy(pairs):
    a, b = pairs
    p, q = map(quaternions, pairs)
    assert same(ours.multiply(p, q), quaternions(a * b))
    assert same(ours.inverse(p), quaternions(a.inv()))
    assert np.allclose(ours.to_matrix(p), a.as_matrix(), atol=1e-14)
    assert same(ours.from_matrix(a.as_matrix()), p)


def test_vectors_are_turned_as_scipy_turns_them(pairs):
    vectors = np.random.default_rng(3).normal(size=(200, 3))
    assert np.allclose(ours.rotate(quaternions(pairs[0]), vectors), pairs[0].apply(vectors), atol=1e-13)


def test_half_turns_survive_the_matrix():
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0], [0, 0.6, -0.8]], dtype=float)
    turns = Rotation.from_rotvec(np.pi * axes)
    assert same(ours.from_matrix(turns.as_matrix()), quaternions(turns), 1e-7)


@pytest.mark.parametrize("order", ["ZYX", "ZXY", "XYZ", "YXZ", "ZXZ", "XZ"])
def test_any_order_of_turns_is_intrinsic(order):
    angles = np.random.default_rng(4).uniform(-3, 3, (50, len(order)))
    expected = quaternions(Rotation.from_euler(order, angles))
    assert same(ours.from_euler(angles, order), expected)


def test_rotation_vectors_near_zero_keep_their_digits():
    vectors = np.concatenate([np.random.default_rng(5).normal(size=(50, 3)), 1e-9 * np.eye(3), np.zeros((1, 3))])
    assert same(ours.from_axis_angle(vectors), quaternions(Rotation.from_rotvec(vectors)), 1e-15)


def test_slerp_agrees_with_scipy(pairs):
    share = np.random.default_rng(6).uniform(size=200)
    found = ours.slerp(quaternions(pairs[0]), quaternions(pairs[1]), share)
    for i in range(200):
        ends = Rotation.concatenate([pairs[0][i], pairs[1][i]])
        assert same(found[i], quaternions(Slerp([0.0, 1.0], ends)(share[i : i + 1]))[0], 1e-7)


def test_slerp_of_near_rotations_is_unit_and_ordered():
    start = np.array([1.0, 0, 0, 0])
    end = ours.from_axis_angle(np.array([1e-6, 0, 0]))
    middle = ours.slerp(start, end, 0.25)
    assert np.isclose(2 * middle[1], 0.25e-6, rtol=1e-9)
    assert np.isclose(np.linalg.norm(middle), 1)


def test_between_turns_one_direction_onto_the_other_by_the_angle_between_them(pairs):
    start, end = pairs[0].apply([1, 0, 0]), pairs[1].apply([0, 2, 0])
    turn = ours.between(start, end)
    assert np.allclose(ours.rotate(turn, start), end / 2, atol=1e-12)
    assert np.allclose(ours.angle(turn), np.arccos(np.sum(start * end, axis=1) / 2), atol=1e-9)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8]])
def test_between_opposite_directions_is_a_half_turn(axis):
    turn = ours.between(np.array(axis, float), -np.array(axis, float))
    assert np.allclose(ours.rotate(turn, np.array(axis, float)), -np.array(axis), atol=1e-7)


def test_continuous_changes_signs_only(pairs):
    rotations = quaternions(pairs[0])[:, None]
    smooth = ours.continuous(rotations)
    assert np.allclose(np.abs(smooth), np.abs(rotations))
    assert (np.sum(smooth[1:] * smooth[:-1], axis=-1) >= 0).all()
    assert smooth[0, 0, 0] >= 0


def test_rotation_vectors_and_back():
    vectors = np.random.default_rng(5).normal(size=(200, 3))
    vectors *= (np.random.default_rng(6).uniform(0, np.pi, 200) / np.linalg.norm(vectors, axis=1))[:, None]
    vectors[0], vectors[1] = 0, [1e-12, 0, 0]
    found = ours.to_axis_angle(ours.from_axis_angle(vectors))
    np.testing.assert_allclose(found, vectors, atol=1e-9)
    np.testing.assert_allclose(ours.to_axis_angle(-ours.from_axis_angle(vectors)), vectors, atol=1e-9)


def test_heading_is_the_turn_about_the_vertical():
    random = np.random.default_rng(7)
    rotations = quaternions(Rotation.random(50, random_state=1))
    heading = ours.heading(rotations)
    assert np.abs(heading[:, [1, 3]]).max() == 0
    # what is left has none, and turning the whole adds to it
    np.testing.assert_allclose(
        ours.heading(ours.multiply(ours.inverse(heading), rotations)), np.eye(4)[[0] * 50], atol=1e-9
    )
    turn = ours.from_axis_angle(random.uniform(-3, 3, size=(50, 1)) * [0.0, 1.0, 0.0])
    both = ours.multiply(turn, heading)
    together = ours.heading(ours.multiply(turn, rotations))
    np.testing.assert_allclose(np.abs(np.sum(both * together, axis=1)), 1, atol=1e-9)
    upside_down = np.array([0.0, 1.0, 0.0, 0.0])
    np.testing.assert_array_equal(ours.heading(upside_down), [1, 0, 0, 0])
