"""A folder of takes: index rebuilt, copies merge, damage is named."""

import json
import os
import shutil

import numpy as np
import pytest

from hemline.datasets import create, open_dataset
from hemline.datasets.take import Take, read_take, write_take
from hemline.errors import BadDataset, BadOutput
from tests.datasets.dataset_samples import make_garment, make_take


@pytest.fixture
def garment():
    return make_garment()


@pytest.fixture
def dataset(tmp_path, garment):
    made = create(tmp_path / "data", garment)
    for seed, clip in enumerate(("02_01", "05_02", "07_01")):
        made.add(make_take(garment, clip, seed=seed))
    return made


def test_a_take_comes_back_as_it_was_written(tmp_path, garment):
    take = make_take(garment)
    write_take(tmp_path / "t.safetensors", take)
    back = read_take(tmp_path / "t.safetensors")
    np.testing.assert_array_equal(back.vertices, take.vertices)
    np.testing.assert_array_equal(back.motion.rotations, take.motion.rotations)
    np.testing.assert_array_equal(back.end_state["velocities"], take.end_state["velocities"])
    assert (back.name, back.figures, back.failed) == (take.name, dict(take.figures), None)
    assert back.clip_frames.tolist() == [2, 3, 4, 5]


def test_quantised_vertices_are_within_five_micrometres(tmp_path, garment):
    take = make_take(garment, frames=50)
    write_take(tmp_path / "t.safetensors", take, quantised=True)
    error = np.abs(read_take(tmp_path / "t.safetensors").vertices.astype(np.float64) - take.vertices).max()
    assert 1e-7 < error < 5.2e-6  # half a step, and float32's rounding of numbers near 3


def test_the_same_take_gives_the_same_bytes(tmp_path, garment):
    for name in "ab":
        write_take(tmp_path / name, make_take(garment))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_the_index_is_rebuilt_when_missing_stale_or_garbage(dataset):
    rows = dataset.rows()
    assert [row.clip for row in rows] == ["02_01", "05_02", "07_01"]
    manifest = dataset.folder / "manifest.json"
    assert json.loads(manifest.read_text())["takes"][0]["sha256"] == rows[0].sha256
    for damage in (manifest.unlink, lambda: manifest.write_text("{"), lambda: manifest.write_text('{"version": 99}')):
        damage()
        assert open_dataset(dataset.folder).rows() == rows
    dataset.path(rows[0].name).unlink()
    assert dataset.rows() == rows[1:]


def test_copied_takes_merge_and_those_of_another_garment_do_not(tmp_path, dataset, garment):
    other = create(tmp_path / "other", garment)
    path = other.add(make_take(garment, "10_01", seed=9))
    shutil.copy(path, dataset.takes_folder)
    assert len(dataset.rows()) == 4
    wide = make_garment(2.0)
    stranger = create(tmp_path / "wide", wide)
    shutil.copy(stranger.add(make_take(wide)), dataset.takes_folder)
    with pytest.raises(
        BadDataset, match="made for another garment; got garment hash .*; keep it in a dataset of its own"
    ):
        dataset.rows()
    with pytest.raises(BadDataset, match=r"made for another garment.*choose another folder"):
        create(dataset.folder, wide)


def test_a_changed_byte_is_found(dataset):
    dataset.verify()
    row = dataset.rows()[1]
    path = dataset.path(row.name)
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    stat = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
    with pytest.raises(BadDataset, match="does not match its checksum"):
        dataset.verify()


def test_a_truncated_take_is_named(dataset):
    path = dataset.path(dataset.rows()[0].name)
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(BadDataset, match=f"{path.name}.*damaged"):
        dataset.rows()


def test_what_is_no_dataset_is_refused(tmp_path, garment):
    with pytest.raises(BadDataset, match="is no dataset; got no garment"):
        open_dataset(tmp_path)
    (tmp_path / "file").write_text("")
    with pytest.raises(BadOutput, match="cannot make"):
        create(tmp_path / "file" / "data", garment)


def test_a_missing_rest_state_is_said(dataset):
    with pytest.raises(BadDataset, match="no rest state for these betas"):
        dataset.rest([0.5])


def test_arrays_that_contradict_each_other_are_refused(garment):
    take = make_take(garment)
    with pytest.raises(BadDataset, match="one row a frame; got {'vertices': 5}"):
        Take(**{**{f: getattr(take, f) for f in take.__dataclass_fields__}, "vertices": take.vertices[:5]})
    with pytest.raises(BadDataset, match="kind is 'clip', 'rest' or 'anchor'; got 'film'"):
        Take(**{**{f: getattr(take, f) for f in take.__dataclass_fields__}, "kind": "film"})
