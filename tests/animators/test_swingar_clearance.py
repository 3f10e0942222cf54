"""Takes tell the graph network where the body is: the half-spaces of its collision term."""

import numpy as np
import pytest
import swaying_takes as made
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from hemline import bodies
from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.graph.graph_samples import take_samples
from hemline.datasets import open_collection
from hemline.learning.collision import REACH

STRIDE = 8


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    root = tmp_path_factory.mktemp("near")
    made.swaying(root / "tshirt-light", "tshirt-light")
    data = open_collection([root / "tshirt-light"])
    entries = data.clips()
    size = SwingarConfig(fewest=50, most=400).size
    return data, entries, take_samples(data, entries[:1], entries[1:2], STRIDE, 16, size)


def test_heights_are_those_above_the_nearest_skin_in_the_world(taken):
    data, entries, samples = taken
    batch = samples.frames(samples.training)
    take, body = data.take(entries[0]), bodies.load("anny24").shaped()
    frames = [frame for frame in take.clip_frames.tolist() if frame % STRIDE == 0]
    assert len(frames) == len(batch.heights)
    for row, frame in enumerate(frames):
        posed = body.posed(take.motion[frame])
        far, nearest = KDTree(posed.vertices).query(take.vertices[frame])
        way = take.vertices[frame] - posed.vertices[nearest]
        heights = (way * posed.normals[nearest]).sum(1)
        known = np.isfinite(batch.heights[row])
        assert known.any() and not known[far > REACH].any()
        np.testing.assert_allclose(batch.heights[row][known], heights[known], atol=1e-4)
        turned = batch.normals[row][known] @ seen(take.motion[frame]).T
        np.testing.assert_allclose(turned, posed.normals[nearest][known], atol=1e-3)


def seen(pose):
    """From the heading of a pose to the world: the part of the pelvis's turn that is about the vertical."""
    half = np.arctan2(pose.rotations[0, 2], pose.rotations[0, 0])
    return Rotation.from_rotvec([0, 2 * half, 0]).as_matrix()


def test_frames_that_are_not_trained_on_have_no_term(taken):
    samples = taken[2]
    others = np.setdiff1d(samples.before[samples.training], samples.training)
    assert len(others) and np.isinf(samples.frames(others).heights).all()
