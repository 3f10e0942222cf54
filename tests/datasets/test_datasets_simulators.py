"""Takes of several simulators in one dataset: counted, said, and never mixed where one clip is measured against."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from hemline import animators
from hemline.datasets import create, newest, open_collection, warn_of_others, warn_of_several
from hemline.errors import BadInput, HemlineWarning
from hemline.playback.evaluate import takes_of
from tests.datasets.dataset_samples import make_garment, make_take


def numbered(garment, number: int | None, **options):
    """A take of the simulator of that number; None: from before takes said it."""
    take = make_take(garment, **options)
    return take if number is None else replace(take, inputs=take.inputs | {"simulator": number})


@pytest.fixture
def mixed(tmp_path):
    dataset = create(tmp_path / "data", make_garment())
    for number, seed in ((None, 0), (None, 1), (3, 0)):
        dataset.add(numbered(dataset.garment, number, seed=seed))
    return dataset


def test_the_number_is_part_of_the_name_and_of_the_index(mixed):
    one, other = numbered(mixed.garment, None), numbered(mixed.garment, 3)
    assert one.name != other.name and (one.simulator, other.simulator) == (0, 3)
    assert sorted(row.simulator for row in mixed.rows()) == [0, 0, 3]
    assert sorted(row.simulator for row in mixed.rows()) == [0, 0, 3]  # from the index


def test_who_adds_is_told_how_many_takes_are_of_others(mixed):
    with pytest.warns(HemlineWarning, match="other simulators than this one, number 3; got 2 of number 0; .*kept"):
        warn_of_others(mixed, mixed.rows(), 3)
    own = [row for row in mixed.rows() if row.simulator == 3]
    warn_of_others(mixed, own, 3)


def test_who_learns_is_told_that_they_are_mixed(mixed, tmp_path):
    said = "takes of several simulators in .*data; got 2 of number 0, 1 of number 3; "
    with pytest.warns(HemlineWarning, match=said):
        warn_of_several([mixed])
    with pytest.warns(HemlineWarning, match=said):
        open_collection([mixed.folder])
    # two datasets, each of one simulator, are as mixed as one of both
    alone = []
    for number, size in ((None, 2.0), (1, 3.0)):
        dataset = create(tmp_path / f"of{size}", make_garment(size))
        dataset.add(numbered(dataset.garment, number))
        warn_of_several([dataset])
        alone.append(dataset.folder)
    with pytest.warns(HemlineWarning, match="got 1 of number 0, 1 of number 1"):
        open_collection(alone)


def test_a_clip_is_measured_against_the_newest_alone(mixed):
    with pytest.warns(HemlineWarning, match="of clip 'a'; got 2 of number 0, 1 of number 3; those of number 3 are"):
        (row,) = newest(mixed.rows(), "clip 'a'")
    assert row.simulator == 3
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert newest([row], "clip 'a'") == [row] and newest([], "clip 'a'") == []


def test_the_rest_state_is_that_of_the_newest_simulator(tmp_path):
    dataset = create(tmp_path / "data", make_garment())
    for number in (2, None, 1):
        rest = replace(numbered(dataset.garment, number, frames=1, seed=number or 0), kind="rest")
        dataset.add(rest)
    assert dataset.rest().simulator == 2
    assert [row.simulator for row in dataset.rest_rows(np.zeros(16))] == [0, 1, 2]


def test_the_door_of_fits_says_it_before_anything_is_learned(mixed):
    # nothing is fitted for this one, so that it refuses; the warning comes first
    with pytest.warns(HemlineWarning, match="takes of several simulators in .*data"), pytest.raises(BadInput):
        animators.fit(mixed, "live")


def test_evaluate_takes_the_truth_of_the_newest_simulator(mixed):
    motion = numbered(mixed.garment, 3).motion
    with pytest.warns(HemlineWarning, match="clip '02_01' in .*data; got 2 of number 0, 1 of number 3"):
        (take,) = takes_of(mixed, motion, np.zeros(16))
    assert take.simulator == 3
