"""Takes walked through: frames say what the player would tell a network, and where the truth is."""

import shutil
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
import torch

from hemline import bodies
from hemline.animators import lag
from hemline.animators.coarse.features.pelvis_frame import PelvisFrame
from hemline.animators.coarse.fit.walk import TakeWalk, frame_bytes, walk_takes
from hemline.animators.coarse.model import CoarseAnimator
from hemline.animators.coarse.relatives import Relatives
from hemline.animators.coarse.weights import Weights
from hemline.animators.swingar.fit.frame_reader import HALF_PRECISION, FrameReader, row_numbers
from hemline.animators.swingar.fit.frame_tensors import FrameTensors
from hemline.animators.swingar.fit.graph_samples import TakeSamples
from hemline.animators.swingar.fit.mirror import mirror_garment
from hemline.datasets import open_collection
from hemline.errors import BadDataset, BadOutput
from hemline.garments.proxy.proxy import ProxySize
from hemline.learning.mirror import mirror_transforms
from hemline.motions.quaternions import rotate
from tests.animators import swaying_takes as made

SIZE = ProxySize(0.035, 50, 400)
LEAD_IN = 6


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    """A garment in two takes, the first frames of one being its lead-in."""
    root = tmp_path_factory.mktemp("walked") / "skirt-light"
    dataset = made.swaying(root, "skirt-light", ("walk",))
    take = dataset.take(dataset.clips()[0])
    lead = np.arange(len(take.motion)) < LEAD_IN
    dataset.add(replace(take, lead_in=lead, inputs={**take.inputs, "clip": "led into"}))
    return open_collection([root])


@pytest.fixture(scope="module")
def frames(data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("frames")
    (worn,), (takes,) = walk_takes(data, data.clips(), TakeWalk(SIZE, 7, 2), folder, jobs=1, tell=lambda *_: None)
    return worn, [data.take(each) for each in takes], folder


def test_it_keeps_the_frames_that_are_wanted_and_two_before_each(frames):
    worn, takes, _ = frames
    for number, take in enumerate(takes):
        clip = take.clip_frames.tolist()
        wanted = {frame for frame in clip if frame % 7 == 0}
        kept = {max(frame - back, 0) for frame in wanted for back in (0, 1, 2)} & set(clip)
        mine = worn.take == number
        assert sorted(worn.frame[mine].tolist()) == sorted(kept)
        assert {int(frame) for frame in worn.frame[mine & worn.wanted]} == wanted
    for row in np.flatnonzero(worn.wanted & (worn.frame >= LEAD_IN + 2)):
        assert worn.frame[worn.before[row]].tolist() == [worn.frame[row] - 1, worn.frame[row] - 2]
        assert (worn.take[worn.before[row]] == worn.take[row]).all() and worn.has_past[row]
    assert not worn.has_past[worn.frame == LEAD_IN].any()


def test_the_truth_is_that_of_the_take_by_either_way(frames):
    worn, takes, _ = frames
    body = bodies.load("anny24").shaped()
    for row in range(len(worn)):
        take, frame = takes[worn.take[row]], int(worn.frame[row])
        seen = PelvisFrame.of(take.motion[frame])
        np.testing.assert_allclose(seen.to_world(worn.truth[row]), take.vertices[frame], atol=1e-5)
        # and from skinning, by weights and transforms as a network is given them
        blended = np.einsum("vj,jab->vab", worn.skin, worn.transforms[row])
        skinned = np.einsum("vab,vb->va", blended[:, :, :3], worn.fit[:, 3:6]) + blended[:, :, 3]
        there = skinned + rotate(worn.turns[row].astype(float), worn.displacements[row].astype(float))
        np.testing.assert_allclose(there, worn.truth[row], atol=2e-3)  # half precision
        assert np.allclose(worn.joints[row], seen.to_local(body.posed(take.motion[frame]).joints), atol=1e-5)


@dataclass
class Recorder:
    """A network that leaves cloth where skinning puts it, and records its features."""

    features: list[np.ndarray] = field(default_factory=list)

    def prepare(self, proxy: Any) -> None:
        return None

    def start(self, pose: Any) -> None:
        return None

    def predict(self, prepared: Any, proxy: Any, trail: Any, history: Any, posed: Any) -> tuple[None, np.ndarray]:
        self.features.append(trail.features(proxy, posed))
        return None, trail.skinned

    def arrays(self) -> dict[str, np.ndarray]:
        return {}

    def extra(self) -> dict[str, Any]:
        return {}


def test_a_network_is_given_the_same_features_as_in_play(data, frames):
    worn, takes, _ = frames
    body, recorder = bodies.load("anny24").shaped(), Recorder()
    number, take = next((i, each) for i, each in enumerate(takes) if each.lead_in.any())
    seconds = (LEAD_IN - 1) / take.motion.fps
    config = lag.LagConfig(edge=SIZE.edge, fewest=SIZE.fewest, most=SIZE.most, beginning=seconds)
    weights = Weights(lag.KIND, config, recorder, Relatives([], np.zeros((0, 256), np.float32)), {}, [])
    garment, rest = data.garments[0], data.datasets[0].rest(()).vertices[0]
    animator = CoarseAnimator(garment, rest, body.body.name, body.body.hash, weights)
    state = animator.start(body.posed(take.motion[0]))
    for frame in range(1, len(take.motion)):
        state, _ = animator.step(state, body.posed(take.motion[frame]), 1 / take.motion.fps)
    for row in np.flatnonzero(worn.take == number):
        np.testing.assert_allclose(worn.features[row], recorder.features[worn.frame[row] - 1], atol=1e-3)


def test_what_is_there_is_kept_and_what_is_damaged_is_made_again(data, frames, tmp_path):
    folder = shutil.copytree(frames[2], tmp_path / "frames")  # a file that is mapped must not become shorter
    (path,) = folder.glob("*.safetensors")
    before, content = path.stat().st_mtime_ns, path.read_bytes()
    walk_takes(data, data.clips(), TakeWalk(SIZE, 7, 2), folder, jobs=1, tell=lambda *_: None)
    assert path.stat().st_mtime_ns == before
    path.write_bytes(content[: len(content) // 2])
    walk_takes(data, data.clips(), TakeWalk(SIZE, 7, 2), folder, jobs=1, tell=lambda *_: None)
    assert path.read_bytes() == content
    walk_takes(data, data.clips(), TakeWalk(SIZE, 6), folder, jobs=1, tell=lambda *_: None)
    assert len(list(folder.glob("*.safetensors"))) == 2


def test_takes_without_a_frame_that_is_wanted_are_refused(data, tmp_path):
    led = [each for each in data.clips() if each.row.clip == "led into"]
    with pytest.raises(BadDataset, match="a take must have a frame to learn from"):
        walk_takes(data, led, TakeWalk(SIZE, 1000), tmp_path, jobs=1, tell=lambda *_: None)


def test_a_mirror_twice_is_what_was_and_once_skins_to_the_mirror_image(frames):
    worn = frames[0]
    samples = TakeSamples.of([worn], [np.ones(len(worn), bool)], 16)
    batch, garment = samples.frames(np.arange(len(worn))), samples.garments[0]
    plain_frames = FrameTensors.of(batch, torch.device("cpu"))
    image, other = plain_frames.mirror(), mirror_garment(garment)
    for name in ("motion", "transforms", "joints", "body", "heading", "truth", "features", "turns"):
        assert not np.array_equal(getattr(image, name), getattr(batch, name)), name
        np.testing.assert_array_equal(getattr(image.mirror(), name), getattr(batch, name), err_msg=name)
    np.testing.assert_array_equal(image.transforms, mirror_transforms(batch.transforms))
    twice = mirror_garment(other)
    np.testing.assert_array_equal(twice.features, garment.features)
    np.testing.assert_array_equal(twice.skin_logits, garment.skin_logits)

    def skinned(logits, points, transforms):
        weights = np.exp(logits) / np.exp(logits).sum(1, keepdims=True)
        blended = np.einsum("vj,fjab->fvab", weights, transforms)
        return np.einsum("fvab,vb->fva", blended[..., :3], points) + blended[..., 3]

    plain = skinned(garment.skin_logits, garment.features[:, 3:6], batch.transforms)
    mirrored = skinned(other.skin_logits, other.features[:, 3:6], image.transforms.numpy())
    np.testing.assert_allclose(mirrored, plain * [-1, 1, 1], atol=1e-5)


def test_the_beginning_can_be_forgotten_and_nothing_else(frames):
    worn = frames[0]
    samples = TakeSamples.of([worn], [np.ones(len(worn), bool)], 16)
    plain = FrameTensors.of(samples.frames(np.arange(len(worn))), torch.device("cpu"))
    forgotten = plain.forget_beginning()
    changed = (forgotten.features != plain.features).any(0).any(0)
    assert changed.sum() == 4 and not forgotten.features[..., changed].any()


def test_frames_are_read_by_their_numbers(frames):
    worn = frames[0]
    samples = TakeSamples.of([worn, worn], [np.ones(len(worn), bool)] * 2, 16)
    assert row_numbers(samples).tolist() == [*range(len(worn))] * 2
    chosen = len(worn) + np.array([2, 0])
    read = FrameReader(samples, torch.device("cpu")).read(chosen)
    np.testing.assert_array_equal(read.truth, worn.truth[[2, 0]])
    one = FrameTensors.of(samples.frames(np.arange(len(worn))), torch.device("cpu"), halves=HALF_PRECISION).byte_count
    for room in (10 * one, one, 1):  # for both garments, for the first, for none
        kept = FrameReader(samples, torch.device("cpu"), room)
        for rows in (chosen, chosen - len(worn)):
            picked = kept.read(rows)
            np.testing.assert_array_equal(picked.truth, read.truth)
            np.testing.assert_allclose(picked.features, read.features, atol=2e-3)


def test_scales_are_mean_and_spread_of_what_is_learned_from(frames):
    worn = frames[0]
    trains = np.arange(len(worn)) % 2 == 0
    samples = TakeSamples.of([worn], [trains], 16)
    mean, spread = samples.scales()
    np.testing.assert_array_equal(samples.training, np.flatnonzero(trains & worn.wanted))
    rows = samples.training[:: max(1, len(samples.training) // 8)]
    features = samples.frames(rows).features.reshape(-1, len(mean)).astype(np.float64)
    np.testing.assert_allclose(mean, features.mean(0), atol=1e-5)
    varied = features.std(0) > 0.011
    np.testing.assert_allclose(spread[varied], features.std(0)[varied], rtol=1e-3)
    assert (spread[~varied] >= 0.01).all()


def test_the_room_that_frames_need_is_known_before_they_are_written(data, frames, tmp_path, monkeypatch):
    (path,) = frames[2].glob("*.safetensors")
    needed = frame_bytes(data, data.clips(), TakeWalk(SIZE, 7, 2))
    assert needed == pytest.approx(path.stat().st_size, rel=0.15)
    usage = shutil.disk_usage(tmp_path)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: usage._replace(free=needed - 1))
    with pytest.raises(BadOutput, match="the frames of a fit need .* GB in .*; got .* GB free"):
        walk_takes(data, data.clips(), TakeWalk(SIZE, 7, 2), tmp_path, jobs=1, tell=lambda *_: None)
    assert not list(tmp_path.iterdir())
