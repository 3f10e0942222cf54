"""Limbs through cloth: a sleeve around a forearm, and the same sleeve beside it."""

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies import LIMBS, limb_bones
from hemline.metrics import limbs_through, limbs_through_figures, worst_edge_ratio
from hemline.motions.motion import JOINT_NAMES


def tube(start, end, radius, rows=9, columns=12):
    """An open tube around the line from start to end."""
    along = (end - start) / np.linalg.norm(end - start)
    across = np.cross(along, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    other = np.cross(along, across)
    turn = 2 * np.pi * np.arange(columns) / columns
    ring = radius * (np.cos(turn)[:, None] * across + np.sin(turn)[:, None] * other)
    vertices = np.concatenate([start + t * (end - start) + ring for t in np.linspace(0, 1, rows)])
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1], np.roll(index[:-1], -1, 1), index[1:], np.roll(index[1:], -1, 1)
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    return vertices, faces.astype(np.int32)


def hit_by_barycentric_coordinates(p, q, vertices, faces):
    """Whether segment p q goes through a triangle, by solving for the point of each triangle's plane."""
    for a, b, c in vertices[faces]:
        system = np.stack([b - a, c - a, p - q], axis=1)
        if abs(np.linalg.det(system)) < 1e-15:
            continue
        u, v, t = np.linalg.solve(system, p - a)
        if u >= 0 and v >= 0 and u + v <= 1 and 0 < t < 1:
            return True
    return False


@pytest.fixture(scope="module")
def joints():
    return bodies.load("anny24").shaped().joints.astype(float)


@pytest.fixture(scope="module")
def skin():
    shaped = bodies.load("anny24").shaped()
    return shaped.vertices, shaped.body.faces


def forearm(joints):
    return (joints[JOINT_NAMES.index(f"left_{each}")] for each in ("elbow", "wrist"))


def test_bones_lie_on_their_limb_and_leave_its_ends_out(joints):
    bones = limb_bones(joints)
    elbow, wrist = forearm(joints)
    bone = bones[LIMBS.index("left forearm")]
    np.testing.assert_allclose(bone, [elbow + 0.15 * (wrist - elbow), wrist + 0.15 * (elbow - wrist)])
    np.testing.assert_allclose(limb_bones(np.stack([joints, joints + 1])), [bones, bones + 1])
    np.testing.assert_allclose(bones[0::2] * [-1, 1, 1], bones[1::2], atol=1e-3)  # left and right alike


def test_a_sleeve_around_the_arm_is_not_gone_through_and_one_pulled_off_sideways_is(joints, skin):
    elbow, wrist = forearm(joints)
    vertices, faces = tube(elbow, wrist, 0.05)
    assert not limbs_through(limb_bones(joints), vertices, faces, *skin).any()
    along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    off, _ = tube(elbow, elbow + 0.5 * (along + np.cross(along, [0.0, 0.0, 1.0])), 0.05)  # turned away by 45 degrees
    names = [LIMBS[k] for k in np.flatnonzero(limbs_through(limb_bones(joints), off, faces, *skin))]
    assert names == ["left forearm"]
    far = vertices + [0.5, 0.0, 0.0]
    assert not limbs_through(limb_bones(joints), far, faces, *skin).any()


def test_a_bone_that_lies_in_another_part_of_the_body_does_not_count(joints, skin):
    elbow, wrist = forearm(joints)
    along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    thigh, faces = tube(elbow, elbow + 0.5 * (along + np.cross(along, [0.0, 0.0, 1.0])), 0.05)
    body = np.concatenate([skin[0], thigh]), np.concatenate([skin[1], faces + len(skin[0])])
    cloth = thigh + 0.005 * np.sign(thigh - thigh.mean(axis=0))
    assert limbs_through(limb_bones(joints), cloth, faces, *skin).sum() == 1
    assert limbs_through(limb_bones(joints), cloth, faces, *body).sum() == 0


def test_it_agrees_with_barycentric_coordinates(joints, skin):
    random = np.random.default_rng(3)
    bones = limb_bones(joints)
    vertices = bones.reshape(-1, 3)[random.integers(16, size=90)] + random.normal(0, 0.12, (90, 3))
    faces = np.arange(90, dtype=np.int32).reshape(-1, 3)
    wanted = [hit_by_barycentric_coordinates(*bone, vertices, faces) for bone in bones]
    assert 0 < sum(wanted) < len(wanted)
    assert limbs_through(bones, vertices, faces, *skin).tolist() == wanted


def test_figures_name_the_worst_limb():
    frames = np.zeros((4, len(LIMBS)), bool)
    frames[1:, 2] = frames[1, 5] = True
    figures = limbs_through_figures(list(frames), LIMBS)
    assert figures == {
        "mean": pytest.approx(100 * 4 / 32),
        "frames": pytest.approx(75),
        "worst_limb_percent": pytest.approx(75),
        "worst_limb": LIMBS[2],
    }
    assert limbs_through_figures([frames[0]], LIMBS)["worst_limb"] is None


def test_the_worst_edge_is_as_many_times_its_length_as_it_was_pulled():
    vertices, faces = tube(np.zeros(3), np.array([0.0, 1.0, 0.0]), 0.1)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    lengths = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    assert worst_edge_ratio(vertices, edges, lengths) == pytest.approx(1)
    pulled = vertices * [1, 3.5, 1]
    upright = np.abs(np.diff(vertices[edges], axis=1)[:, 0, 1]) > 0.999 * lengths
    assert upright.any()
    np.testing.assert_allclose(worst_edge_ratio(np.stack([vertices, pulled]), edges, lengths), [1, 3.5], rtol=1e-6)
    # a sliver, however long it grows, tears nothing
    moved = vertices.copy()
    moved[1] += [0, 0.03, 0]
    sliver = np.append(lengths, 1e-4)
    ratio = worst_edge_ratio(moved, np.vstack([edges, [[0, 1]]]), sliver)
    assert ratio < 3
