"""The collision term of swingar: the neural distance to the body that each frame sees, mirrored or not."""

import numpy as np
import pytest
import torch

from hemline import bodies
from hemline.animators.coarse.fit.split_frames import SplitFrames
from hemline.animators.coarse.fit.walk import TakeWalk
from hemline.animators.swingar import SwingarConfig
from hemline.animators.swingar.fit.fit_graph import samples_of
from hemline.animators.swingar.fit.frame_tensors import FrameTensors
from hemline.collide.neural_sdf.exact import ExactDistance
from hemline.collide.neural_sdf.neural_sdf import load_neural_sdf
from hemline.datasets import open_collection
from hemline.learning.fit.body_distance import BodyDistance
from hemline.motions.quaternions import to_axis_angle
from tests.animators import swaying_takes as made

CPU = torch.device("cpu")


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
    frames = FrameTensors.of(batch, CPU)
    for row, number in enumerate(chosen):
        pose = take.motion[int(samples.groups[0].frame[number])]
        posed = body.posed(pose)
        exact = ExactDistance.of(posed)
        near = np.abs(exact.signed_distances(posed.vertices[::500] + 0.02 * posed.normals[::500]) - 0.02) < 0.005
        points = (posed.vertices[::500] + 0.02 * posed.normals[::500])[near]
        seen = torch.from_numpy(((points - pose.translation) @ batch.heading[row]).astype(np.float32))
        found = samples.heights(0, seen[None], frames.select(torch.tensor([row])))[0]
        assert np.median(np.abs(found.numpy() - 0.02)) < 0.004


def test_distances_and_gradients_are_those_of_the_network_at_run_time(taken):
    take, _ = taken
    shaped = bodies.load("anny24").shaped((0.7, -1.2))
    poses = [take.motion[frame] for frame in (0, len(take.motion) // 2)]
    posed = [shaped.posed(each) for each in poses]
    points = np.stack([(each.vertices + 0.01 * each.normals)[::200] for each in posed]).astype(np.float32)
    seen = torch.from_numpy(points).requires_grad_()
    transforms = torch.from_numpy(np.stack([each.transforms for each in posed]).astype(np.float32))
    axes = torch.from_numpy(np.stack([to_axis_angle(each.rotations) for each in poses]).astype(np.float32))
    found = BodyDistance(shaped, CPU).distances(seen, transforms, axes)
    found.sum().backward()
    for row, each in enumerate(posed):
        distances, gradients = load_neural_sdf().at(each).with_gradients(points[row])
        np.testing.assert_allclose(found[row].detach(), distances, atol=2e-5)
        np.testing.assert_allclose(seen.grad[row], gradients, atol=5e-3)


def test_a_mirrored_frame_sees_the_body_in_the_mirror(taken):
    samples = taken[1]
    frames = FrameTensors.of(samples.frames(samples.training[:2]), CPU)
    points = frames.truth[:, ::7]
    plain = samples.heights(0, points, frames)
    image = samples.heights(0, points * torch.tensor([-1.0, 1.0, 1.0]), frames.mirror())
    assert float((image - plain).abs().median()) < 0.005
