"""The training of a neural distance: samples that continue, a training that is resumed to the same bits, errors."""

from pathlib import Path

import numpy as np
import pytest

from hemline import bodies, motions
from hemline.collide.neural_sdf.exact import ExactDistance
from hemline.errors import BadDataset, BadInput
from hemline.files import read_tensors, write_tensors
from hemline.models.make.neural_sdf import samples as sampling
from hemline.models.make.neural_sdf.samples import in_pelvis_frame, produce_samples, sample_bodies
from hemline.models.make.neural_sdf.training import SdfConfig, train_sdf

pytest.importorskip("torch", reason="training needs torch (extra 'learn')")


@pytest.fixture
def few(monkeypatch) -> None:
    monkeypatch.setattr(sampling, "POINTS", 80)
    monkeypatch.setattr(sampling, "SHARD", 2)


def clips():
    return [motions.load("walk"), motions.load("dance")]


def test_samples_hold_exact_distances_in_the_frame_of_the_pelvis(few):
    body = bodies.load("anny24")
    found = sample_bodies(body, clips(), 2, np.random.default_rng(0), largest=2.0)
    assert found.points.shape == (2, 80, 3) and np.abs(found.betas).max() <= 2.0
    shaped = body.shaped(found.betas[1])
    posed = shaped.posed(in_pelvis_frame(shaped, found.rotations[1]))
    np.testing.assert_allclose(posed.transforms[0], np.eye(4)[:3], atol=1e-6)
    np.testing.assert_allclose(ExactDistance.of(posed).signed_distances(found.points[1]), found.distances[1], atol=1e-5)
    near = np.abs(found.distances) < 0.02
    assert 0.4 < near.mean() < 0.8 and 0.15 < (found.distances < 0).mean() < 0.6


def test_samples_continue_where_they_were_and_are_refused_for_another_body(few, tmp_path):
    body = bodies.load("anny24")
    first = produce_samples(tmp_path, body, clips, 2, 0)
    kept = (tmp_path / "000.safetensors").read_bytes()
    both = produce_samples(tmp_path, body, clips, 3, 0)
    assert len(first) == 1 and len(both) == 2
    assert (tmp_path / "000.safetensors").read_bytes() == kept
    np.testing.assert_array_equal(both[0].points, first[0].points)
    produce_samples(tmp_path, body, lambda: pytest.fail("all is there"), 3, 0)
    arrays, metadata = read_tensors(tmp_path / "001.safetensors", "distances")
    write_tensors(tmp_path / "001.safetensors", arrays, metadata | {"body_hash": "other"})
    with pytest.raises(BadDataset, match="was made for another body"):
        produce_samples(tmp_path, body, clips, 3, 0)
    (tmp_path / "001.safetensors").write_bytes(kept[:200])
    with pytest.raises(BadDataset, match="001"):
        produce_samples(tmp_path, body, clips, 3, 0)


def test_a_killed_training_comes_to_the_same_bits(few, tmp_path):
    body = bodies.load("anny24")
    data = [sample_bodies(body, clips(), 6, np.random.default_rng(0))]
    config = SdfConfig(width=16, updates=8, bodies=2, points=20)
    whole = train_sdf(body, data, data, config)

    class Killed(Exception):
        pass

    def kill(done: int, total: int) -> None:
        if done == 1:
            raise Killed

    with pytest.raises(Killed):
        train_sdf(body, data, data, config, checkpoint=tmp_path / "kept.safetensors", progress=kill)
    resumed = train_sdf(body, data, data, config, checkpoint=tmp_path / "kept.safetensors")
    for name, layer in whole.layers.items():
        for one, other in zip(layer, resumed.layers[name], strict=True):
            np.testing.assert_array_equal(one, other)
    assert whole.figures["bodies"] == 6 and whole.figures["held_out_mm"] > 0
    assert whole.beta_range[1] == pytest.approx(float(np.abs(data[0].betas).max()))


def test_a_training_learns(few):
    body = bodies.load("anny24")
    data = [sample_bodies(body, clips(), 6, np.random.default_rng(0))]
    short, longer = (
        train_sdf(body, data, data, SdfConfig(width=32, updates=updates, bodies=6)).figures["held_out_mm"]
        for updates in (1, 60)
    )
    assert longer < 0.7 * short


def test_folders_without_clips_and_wrong_options_are_refused(tmp_path):
    with pytest.raises(BadDataset, match="cannot be split by subject"):
        sampling.clips_by_side(Path(tmp_path))
    with pytest.raises(BadInput, match="width"):
        SdfConfig(width=0)
    with pytest.raises(BadInput, match="inputs"):
        SdfConfig(inputs="heads")  # pyright: ignore[reportArgumentType]
