"""The body cut into leaves and patches."""

import numpy as np
import pytest

from hemline.collide.surface.patches import LEAF, PATCH_SIZE, dominant_joints, limbs, make_patches, vertex_blocks
from hemline.errors import BadBody
from hemline.motions import JOINT_NAMES, PARENTS
from tests.collide.projection_samples import clip, two_balls

pytestmark = pytest.mark.usefixtures("all_threads")  # kernels with parallel loops


@pytest.fixture(scope="module")
def person():
    shaped, _, _ = clip("walk", frames=1)
    return shaped, make_patches(shaped)


def test_every_face_is_in_one_leaf_and_every_leaf_lists_its_vertices(person):
    shaped, patches = person
    real = patches.faces[patches.faces[:, 0] != patches.faces[:, 1]]
    back = np.sort(patches.order[real], axis=1)
    assert sorted(map(tuple, back)) == sorted(map(tuple, np.sort(shaped.body.faces, axis=1)))
    for leaf in range(len(patches.leaf_start) - 1):
        listed = patches.leaf_vertices[patches.leaf_start[leaf] : patches.leaf_start[leaf + 1]]
        assert set(listed) == set(patches.faces[leaf * LEAF : leaf * LEAF + LEAF].reshape(-1))


def test_patches_are_small_and_leaves_nearly_full(person):
    shaped, patches = person
    middle = shaped.vertices[patches.order][patches.faces].mean(axis=1)
    for first, last in zip(patches.patch_start[:-1], patches.patch_start[1:], strict=True):
        extent = np.ptp(middle[first * LEAF : last * LEAF], axis=0)
        assert np.linalg.norm(extent) <= PATCH_SIZE + 0.05  # the points that fill a leaf are corners, not middles
    assert len(shaped.body.faces) / len(patches.faces) > 0.95


def test_across_and_around(person):
    _, patches = person
    face = np.flatnonzero(patches.faces[:, 0] != patches.faces[:, 1])[::37]
    for f in face:
        for edge in range(3):
            ends = {patches.faces[f, edge], patches.faces[f, (edge + 1) % 3]}
            other = patches.across[f, edge]
            assert other != f
            assert ends <= set(patches.faces[other])
        vertex = patches.faces[f, 0]
        ring = patches.ring[patches.ring_start[vertex] : patches.ring_start[vertex + 1]]
        assert sorted(ring) == sorted(
            g for g in np.flatnonzero((patches.faces == vertex).any(1)) if patches.faces[g, 0] != patches.faces[g, 1]
        )


def test_limbs_of_the_skeleton_and_of_a_chain():
    limb = limbs(np.array(PARENTS))
    names = {JOINT_NAMES[joint]: JOINT_NAMES[limb[joint]] for joint in range(24)}
    assert names["spine2"] == names["pelvis"] == "pelvis"
    assert names["left_hand"] == names["left_elbow"] == "left_collar"
    assert names["right_foot"] == "right_hip"
    assert len(set(limb)) == 6
    assert limbs(np.array([-1, 0, 1, 2])).tolist() == [0, 0, 0, 0]


def test_limb_of_a_vertex_follows_its_largest_weight(person):
    shaped, patches = person
    joints = dominant_joints(shaped.body.weight_indices, shaped.body.weights)
    assert (patches.limb == limbs(shaped.body.parents)[joints[patches.order]]).all()


def test_blocks_hold_each_vertex_once_and_are_compact():
    points = np.random.default_rng(0).uniform(size=(1003, 3)).astype(np.float32)
    order = vertex_blocks(points, 8)
    assert sorted(order) == list(range(1003))
    spread = [np.ptp(points[order[k : k + 8]], axis=0).max() for k in range(0, 1003, 8)]
    assert np.mean(spread) < 0.35


def test_a_body_with_a_hole_is_refused():
    shaped, _ = two_balls(0.5)
    shaped.body.faces = shaped.body.faces[1:]
    with pytest.raises(BadBody, match=r"closed body mesh; got 3 edges .*; close its holes"):
        make_patches(shaped)
