"""The collision term of swingar: the neural distance to the body that each frame sees, mirrored or not."""

import numpy as np
import pytest

from hemline import bodies
from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.animators.coarse.fit.walk import TakeWalk
from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.fit.fit_graph import samples_of
from hemline.animators.swingar.fit.mirror import mirror_frames
from hemline.collide.neural_sdf.exact import ExactDistance
from hemline.datasets import open_collection
from tests.animators import swaying_takes as made


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    root = tmp_path_factory.mktemp("near")
    made.swaying(root / "tshirt-light", "tshirt-light")
    data = open_collection([root / "tshirt-light"])
    entries = data.clips()
    sides = {"train": entries[:1], "new_clip": entries[1:2]}
    frames = SplitFrames.of(data, sides, TakeWalk(SwingarConfig(fewest=50, most=400).size, 8), root / "frames")
    return data.take(entries[0]), samples_of(frames, 16)


def test_the_body_of_a_frame_is_that_of_the_take(taken):
    take, samples = taken
    chosen = samples.training[:3]
    batch, body = samples.frames(chosen), bodies.load("anny24").shaped()
    for row, (number, distance) in enumerate(zip(chosen, samples.bodies(0, batch), strict=True)):
        posed = body.posed(take.motion[int(samples.groups[0].frame[number])])
        exact = ExactDistance.of(posed)
        near = np.abs(exact.signed_distances(posed.vertices[::500] + 0.02 * posed.normals[::500]) - 0.02) < 0.005
        points = (posed.vertices[::500] + 0.02 * posed.normals[::500])[near]
        seen = (points - take.motion[int(samples.groups[0].frame[number])].translation) @ batch.heading[row]
        assert np.median(np.abs(distance.signed_distances(seen.astype(np.float32)) - 0.02)) < 0.004


def test_a_mirrored_frame_sees_the_body_in_the_mirror(taken):
    samples = taken[1]
    batch = samples.frames(samples.training[:2])
    points = batch.truth[0][::7]
    plain, image = (samples.bodies(0, each)[0] for each in (batch, mirror_frames(batch)))
    apart = np.abs(image.signed_distances(points * np.float32([-1, 1, 1])) - plain.signed_distances(points))
    assert np.median(apart) < 0.005
