"""Several datasets open together."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies
from hemline.datasets import create, open_collection
from hemline.errors import BadDataset
from tests.datasets.dataset_samples import make_garment, make_take

SUBJECTS = ("01", "02", "05", "16")


@pytest.fixture
def folders(tmp_path):
    """Three garments; each subject's clip for each, on two shapes."""
    made = []
    for number in range(3):
        dataset = create(tmp_path / f"garment{number}", make_garment(1.0 + number))
        for seed, subject in enumerate(SUBJECTS):
            take = make_take(dataset.garment, f"{subject}_01", seed=seed)
            betas = np.zeros(16, np.float32)
            betas[0] = seed % 2
            dataset.add(replace(take, betas=betas))
        made.append(dataset.folder)
    return made


def groups(collection, entries, by):
    if by == "subject":
        return {entry.row.subject for entry in entries}
    return {collection.datasets[entry.dataset].garment.hash for entry in entries}


def test_datasets_carry_their_body(folders):
    collection, body = open_collection(folders), bodies.load("anny24")
    assert collection.datasets[0].body is body and collection.bodies == (body, body, body)


@pytest.mark.parametrize("by", ["subject", "garment"])
def test_each_clip_is_on_one_side_and_so_is_its_group(folders, by):
    collection = open_collection(folders)
    sides = [collection.split(which, by=by, fractions=(0.5, 0.25, 0.25)) for which in ("train", "val", "test")]
    assert sorted(map(repr, sum(sides, []))) == sorted(map(repr, collection.clips()))
    held = [groups(collection, side, by) for side in sides]
    assert all(held) and not (held[0] & held[1] or held[0] & held[2] or held[1] & held[2])


def test_a_take_is_read_from_its_own_dataset(folders):
    collection = open_collection(folders)
    for entry in collection.clips():
        assert collection.take(entry).inputs["garment"] == collection.garments[entry.dataset].hash


def test_few_subjects_are_split_by_clip_but_few_shapes_or_garments_are_not(folders):
    two = open_collection(folders[:2])
    with pytest.raises(BadDataset, match="a split by garment needs three; got 2; simulate more"):
        two.split("train", by="garment")
    with pytest.raises(BadDataset, match="a split by body needs three; got 2"):
        two.split("train", by="body")
    assert two.split("train")


def test_a_collection_of_nothing_or_of_one_garment_twice_is_refused(folders, tmp_path):
    with pytest.raises(BadDataset, match="a collection needs a dataset"):
        open_collection([])
    create(tmp_path / "again", make_garment(1.0))
    with pytest.raises(BadDataset, match="two datasets hold the same garment, square; .*copy the takes of one"):
        open_collection([*folders, tmp_path / "again"])


def test_anchors_are_apart_from_clips_and_keep_their_derivatives(tmp_path):
    dataset = create(tmp_path / "data", make_garment())
    clip = make_take(dataset.garment, frames=1)
    turn = np.arange(12, dtype=np.float32).reshape(4, 3)
    anchor = replace(clip, kind="anchor", inputs=clip.inputs | {"kind": "anchor"}, derivatives={"turn.12.0": turn})
    dataset.add(clip)
    dataset.add(anchor)
    collection = open_collection([dataset.folder])
    (entry,) = collection.anchors()
    assert [each.row.kind for each in collection.clips()] == ["clip"]
    np.testing.assert_array_equal(collection.take(entry).derivatives["turn.12.0"], turn)
    with pytest.raises(BadDataset, match=r"derivative 'beta.0' must have one row a vertex; got shape \(3, 3\)"):
        replace(anchor, derivatives={"beta.0": turn[:3]})
