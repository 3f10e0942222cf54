"""A coarser body around the full one."""

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies import coarser_body
from hemline.errors import BadInput
from hemline.meshes import ClosestTree, boundary_loops
from tests.bodies.body_samples import random_pose


@pytest.fixture(scope="module")
def shaped():
    return bodies.load("anny24").shaped([1.0, -0.5])


@pytest.mark.parametrize(("share", "deepest", "farthest"), [(0.25, 0.0015, 0.01), (0.1, 0.005, 0.02)])
def test_the_skin_is_within_it_at_rest(shaped, share, deepest, farthest):
    around = coarser_body(shaped, share)
    assert len(around.vertices) == round(share * len(shaped.vertices)) and boundary_loops(around.body.faces) == ()
    tree = ClosestTree(around.vertices.astype(np.float64), around.body.faces)
    heights = tree.signed_distances(shaped.vertices.astype(np.float64))
    assert np.percentile(heights, 99) < deepest and heights.min() > -farthest


def test_it_moves_as_the_body_does(shaped):
    around, pose = coarser_body(shaped, 0.25), random_pose(3)
    full, coarse = shaped.posed(pose), around.posed(pose)
    np.testing.assert_array_equal(coarse.transforms, full.transforms)
    np.testing.assert_array_equal(coarse.joints, full.joints)
    far = ClosestTree(full.vertices.astype(np.float64), shaped.body.faces).closest(coarse.vertices).distances
    assert np.percentile(far, 99) < 0.012


def test_it_is_found_once(shaped):
    assert coarser_body(shaped, 0.25) is coarser_body(shaped, 0.25)
    assert coarser_body(shaped, 1.0) is shaped


def test_wrong_shares_are_refused(shaped):
    for share in (0.0, -1.0, 1.5, float("nan")):
        with pytest.raises(BadInput, match="a share of vertices is above 0 and at most 1; got"):
            coarser_body(shaped, share)
