"""Takes with a limb through the cloth, or torn, are found, and fits leave them out."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import bodies
from hemline.bodies import limb_bones
from hemline.datasets import Collection, create, leave_out_faulty
from hemline.errors import HemlineWarning
from tests.datasets.dataset_samples import make_garment, make_take


def through(take, share: float):
    """The take with the first triangle across the left shin in a share of the frames after the lead-in."""
    shaped = bodies.load("anny24").shaped(take.betas)
    _, joints = shaped.transforms_of(take.motion.rotations, take.motion.translations)
    middles = limb_bones(joints)[:, 2].mean(axis=1)
    vertices = take.vertices.copy()
    frames = take.clip_frames[: round(share * len(take.clip_frames))]
    square = np.array([[-0.05, 0, -0.5], [0.95, 0, -0.5], [-0.05, 0, 0.5], [0.95, 0, 0.5]])
    vertices[frames] = middles[frames, None] + square
    return replace(take, vertices=vertices, inputs=take.inputs | {"through": share})


def torn(take, ratio: float):
    """The take with its upper edge that many times too long in the last frame."""
    vertices = take.vertices.copy()
    vertices[-1] = make_garment().vertices + [10, 0, 0]
    vertices[-1, 1, 0] += ratio - 1
    return replace(take, vertices=vertices, inputs=take.inputs | {"torn": ratio})


@pytest.fixture
def data(tmp_path):
    garment = make_garment()
    dataset = create(tmp_path / "data", garment)
    takes = {
        "good": make_take(garment, "02_01", frames=42),
        "graze": through(make_take(garment, "02_02", frames=42), 0.04),
        "through": through(make_take(garment, "02_03", frames=42), 0.3),
        "long": torn(make_take(garment, "02_04", frames=42), 2.5),
        "torn": torn(make_take(garment, "02_05", frames=42), 4.0),
    }
    for take in takes.values():
        dataset.add(take)
    return dataset, {take.name: name for name, take in takes.items()}


def test_the_index_says_what_is_wrong_with_a_take(data):
    dataset, names = data
    rows = {names[row.name]: row for row in dataset.rows()}
    assert {name for name, row in rows.items() if row.faults.reason} == {"through", "torn"}
    assert rows["through"].limbs_through == {"left shin": pytest.approx(30)}
    assert rows["through"].faults.reason == "the left shin is through the cloth in 30 % of the frames"
    assert rows["torn"].edge_ratio == pytest.approx(4.0, rel=0.1)
    assert "times as long" in rows["torn"].faults.reason
    again = type(dataset)(dataset.folder, dataset.garment).rows()
    assert again == dataset.rows()


def test_a_fit_leaves_them_out_and_says_so_in_one_line(data):
    dataset, names = data
    with pytest.warns(HemlineWarning, match="2 of 5: in 1 a limb is through the cloth, in 1 it is torn") as told:
        sound = leave_out_faulty(dataset)
    assert len(told) == 1
    assert {names[row.name] for row in sound.clips()} == {"good", "graze", "long"}
    split = [row for side in ("train", "val", "test") for row in sound.split(side)]
    assert len(split) == 3 and len(dataset.clips()) == 5 and len(sound.rows()) == 5
    with pytest.warns(HemlineWarning, match="2 of 5"):
        both = leave_out_faulty(Collection((dataset,)))
    assert {names[entry.row.name] for entry in both.clips()} == {"good", "graze", "long"}


def test_what_has_no_fault_is_returned_as_it_is(tmp_path, recwarn):
    dataset = create(tmp_path / "data", make_garment())
    dataset.add(make_take(make_garment(), frames=42))
    assert leave_out_faulty(dataset) is dataset and not recwarn.list


def test_where_all_takes_have_faults_they_are_fitted_nevertheless(tmp_path):
    dataset = create(tmp_path / "data", make_garment())
    dataset.add(through(make_take(make_garment(), frames=42), 1.0))
    with pytest.warns(HemlineWarning, match="have faults, and the fit learns them; got 1 of 1"):
        assert leave_out_faulty(dataset) is dataset
