"""Datasets that are continued: parts that go on from others, and takes of other garments or simulators."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from hemline import bodies, motions, sim
from hemline.datasets import create, open_dataset, read_take, take_name
from hemline.errors import BadDataset, BadInput, HemlineWarning
from hemline.files import read_tensors, write_tensors
from hemline.motions.motion import Motion
from hemline.sim.takes import simulate
from hemline.sim.takes.anchor_jobs import AnchorTask, anchor_inputs, anchor_job
from hemline.sim.takes.end_state import check_end_of_take
from hemline.sim.takes.jobs import Call
from hemline.sim.takes.produce import Plan, clip_job, part_inputs
from hemline.sim.takes.rest_states import rest_job
from hemline.sim.takes.setup import Setup
from tests.sim.takes.test_sim_produce import small_garment

SETTINGS = sim.SimSettings(settle=0.5, lead_in=0.2)


def make(folder: Path, name: str = "walk", report=None):
    """Two parts of a third of a second of a napkin of 288 vertices."""
    clip = sim.ClipRequest(motions.load(name)[:16], motions.subject_of(name))
    return sim.produce(folder, small_garment(), [clip], settings=SETTINGS, part_seconds=0.3, report=report)


@cache
def setup() -> Setup:
    return Setup.of(small_garment(), SETTINGS)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "data"
    return folder, make(folder)


@pytest.fixture
def copied(made, tmp_path):
    """A copy of the dataset, and its parts' files."""
    import shutil

    folder = tmp_path / "data"
    shutil.copytree(made[0], folder)
    return folder, [open_dataset(folder).path(row.name) for row in made[1]]


def changed(path: Path, name: str, value: float) -> None:
    """Another first value of an array of a file."""
    arrays, metadata = read_tensors(path, "take")
    arrays[name].reshape(-1)[0] = value
    write_tensors(path, arrays, metadata)


TRIED = [
    ("positions", 1e30),
    ("velocities", 1e30),
    ("change", 1e30),
    ("contact_history", -2),
    ("projector.anchors", 2147483647),
    ("projector.anchors", 1_000_000),
    ("projector.anchors", -2),
]
"""Those that end the process by a signal, or go on with what lies elsewhere in memory, where nobody looks."""


@pytest.mark.parametrize(("name", "value"), TRIED)
def test_no_part_goes_on_from_a_state_that_none_can_have(copied, name, value):
    folder, (first, second) = copied
    second.unlink()
    changed(first, f"end_state.{name}", value)
    before = first.read_bytes()
    with pytest.raises(BadDataset, match=f"'{name}' of the end state of .*{first.name}.*; move the file away and run"):
        make(folder)
    assert first.read_bytes() == before and not second.exists()


HOSTILE = [
    *TRIED,
    ("positions", 101.5),
    ("velocities", -1001),
    ("load", 1e30),
    ("time", 1e30),
    ("rotations", 5),
    ("rotations", 0.1),
    ("translation", 1e30),
    ("pinched", 2),
    ("contact_history", 2147483647),
    ("contact_history", 26692),
    ("projector.anchors", -1),
    ("projector.heights", 1e30),
    ("projector.offsets", 1e30),
    ("projector.directions", 6),
    ("projector.directions", -1),
    ("projector.hidden", 2),
    ("projector.lively", 2),
    ("projector.frame", -1),
    ("positions", np.zeros((288, 3), np.float32)),
    ("positions", np.zeros((287, 3))),
    ("velocities", np.zeros((288, 2))),
    ("projector.anchors", np.zeros(288, np.int64)),
    ("projector.directions", np.zeros(4, np.int8)),
    ("time", np.zeros(2)),
    ("projector.anchors", None),
    ("velocities", None),
    ("more", np.zeros(3)),
]


@pytest.mark.parametrize(("name", "value"), HOSTILE, ids=lambda each: str(getattr(each, "shape", each)))
def test_each_array_of_a_state_is_looked_at(made, name, value):
    end = dict(open_dataset(made[0]).take(made[1][0]).end_state)
    check_end_of_take(end, setup(), (0.0,) * 16, "it.safetensors")
    if isinstance(value, np.ndarray):
        end[name] = value
    elif value is None:
        del end[name]
    else:
        end[name] = end[name].copy()
        end[name].reshape(-1)[0] = value
    with pytest.raises(BadDataset, match="it.safetensors") as found:
        check_end_of_take(end, setup(), (0.0,) * 16, "it.safetensors")
    assert name in str(found.value)


@pytest.mark.parametrize(("name", "value"), TRIED[::4])
def test_nor_does_simulate_itself_take_such_a_state(made, name, value):
    take = open_dataset(made[0]).take(made[1][0])
    array = np.array(take.end_state[name])
    array.reshape(-1)[0] = value
    shaped, state = bodies.load("anny24").shaped(take.betas), {**take.end_state, name: array}
    with pytest.raises(BadInput, match=f"'{name}' of the end state of 'resume'.*give the 'end_state' of a take"):
        sim.simulate(small_garment(), shaped, take.motion[-2:], SETTINGS, resume=state)


def test_what_the_simulator_itself_ends_with_is_gone_on_from(copied):
    folder, (_, second) = copied
    whole = second.read_bytes()
    second.unlink()
    make(folder)
    assert second.read_bytes() == whole


def test_a_garment_that_is_no_longer_near_the_body_ends_the_take(made, monkeypatch):
    monkeypatch.setattr(simulate, "VERTEX_LIMIT", 1.5)  # it hangs from the shoulders, half a metre above the pelvis
    shaped, clip = bodies.load("anny24").shaped(), motions.load("walk")
    take = sim.simulate(small_garment(), shaped, shaped.placed(clip.resample(30))[:3], SETTINGS)
    assert take.failed is not None and "the garment is not worn any more" in take.failed


class Stopped(Exception):
    """The first thing that a report is told."""


def stop(name, done, total):
    raise Stopped


def test_a_damaged_take_of_another_clip_is_put_aside_before_anything_is_simulated(copied):
    folder, (_, second) = copied
    second.write_bytes(second.read_bytes()[:-10])
    with pytest.warns(HemlineWarning, match=f"{second.name}.*is kept as {second.name}.damaged"), pytest.raises(Stopped):
        make(folder, "kick", stop)
    assert not second.exists()


def test_a_take_of_another_clip_that_may_be_whole_ends_it_before_anything_is_simulated(copied):
    folder, (_, second) = copied
    arrays, metadata = read_tensors(second, "take")
    write_tensors(second, arrays, metadata | {"format": 2})
    before = second.read_bytes()
    with pytest.raises(BadDataset, match=f"{second.name} has a newer format; got version 2"):
        make(folder, "kick", stop)
    assert second.read_bytes() == before


def test_rests_and_anchors_that_are_damaged_are_put_aside_and_settled_again(made, tmp_path):
    ours, rest = setup(), open_dataset(made[0]).rest()
    dataset, body = create(tmp_path / "data", ours.garment), ours.body.shaped()
    task = AnchorTask(body.rest_pose, (0.0,) * 16)
    inputs = anchor_inputs(ours.garment, body, task.pose, ours.settings, (), ())
    for take, job in (
        (rest, lambda: rest_job(dataset, ours, ())),
        (replace(rest, kind="anchor", inputs=inputs), lambda: anchor_job(dataset, ours, task)),
    ):
        path = dataset.add(take)
        with pytest.raises(StopIteration) as found:
            next(job())
        assert np.array_equal(found.value.value.vertices, take.vertices)
        path.write_bytes(path.read_bytes()[:-10])
        with pytest.warns(HemlineWarning, match="is kept as"):
            dataset.put_damaged_aside()
        assert isinstance(next(job()), Call)
        dataset.add(take)
        arrays, metadata = read_tensors(path, "take")
        write_tensors(path, arrays, metadata | {"format": 2})
        with pytest.raises(BadDataset, match="newer format"):
            next(job())
        assert path.exists()
        path.unlink()


def run_by_hand(job, take) -> list[str]:
    """Names of the takes of a clip's job whose calls are answered with its own motion, and with that take."""
    answer = next(job)
    try:
        while True:
            if answer.work.__name__ == "_place_motion":
                answer = job.send(answer.argument[1])
            else:
                part = answer.argument[1]
                vertices = np.repeat(take.vertices[:1], len(part), axis=0)
                still = np.zeros(len(part), np.int32)
                made = replace(take, vertices=vertices, motion=part, lead_in=still > 0, pinched=still)
                answer = job.send((made, 0.0))
    except StopIteration as end:
        return end.value


def test_a_part_after_one_that_was_edited_is_another_take(made, tmp_path):
    """Its motion is the same, but the cloth comes into it otherwise."""
    ours = setup()
    dataset, take = create(tmp_path / "data", ours.garment), open_dataset(made[0]).take(made[1][0])
    rotations = np.tile(np.array([1, 0, 0, 0], np.float32), (9, 24, 1))
    still = Motion(rotations, np.zeros((9, 3), np.float32), fps=30, leg_length=0.9, name="still")
    edited = rotations.copy()
    edited[1, 5] = [0.8, 0.6, 0, 0]
    plan, names = Plan(part_seconds=0.1), []
    for motion in (still, replace(still, rotations=edited)):
        job = clip_job(dataset, ours, plan, sim.ClipRequest(motion, "a"), take, lambda done, total: None)
        names.append(run_by_hand(job, take))
    assert [len(each) for each in names] == [3, 3]
    assert not set(names[0]) & set(names[1])


def test_the_number_of_the_simulator_is_in_the_name_of_each_kind_of_take(made):
    dataset, rows = open_dataset(made[0]), made[1]
    assert {row.simulator for row in dataset.rows()} == {sim.SIMULATOR}
    ours, body = setup(), bodies.load("anny24").shaped()
    clip = sim.ClipRequest(motions.load("walk")[:4], "06")
    of_part = part_inputs(ours, Plan(), clip, clip.motion, 0, "")
    of_anchor = anchor_inputs(ours.garment, body, body.rest_pose, ours.settings, (), ())
    for inputs in (of_part, of_anchor, dataset.take(rows[0]).inputs, dataset.rest().inputs):
        assert inputs["simulator"] == sim.SIMULATOR
        assert take_name({**inputs, "simulator": sim.SIMULATOR + 1}) != take_name(inputs)
    assert part_inputs(ours, Plan(), clip, clip.motion, 1, "a") != part_inputs(ours, Plan(), clip, clip.motion, 1, "b")


def test_takes_say_what_they_were_made_with(made):
    dataset = open_dataset(made[0])
    for row in dataset.rows():
        assert dataset.take(row).made_with.keys() == {"hemline", "numba", "numpy", "processor"}


def test_takes_of_another_simulator_are_kept_and_counted_and_none_is_gone_on_from(made, tmp_path):
    ours = setup()
    dataset = create(tmp_path / "data", ours.garment)
    for row in open_dataset(made[0]).rows():
        take = read_take(made[0] / "takes" / f"{row.name}.safetensors")
        older = {key: value for key, value in take.inputs.items() if key != "simulator"}
        dataset.add(replace(take, inputs=older))
    there = {path.name for path in dataset.takes_folder.iterdir()}
    said = rf"other simulators than this one, number {sim.SIMULATOR}; got 3 of number 0; they are kept"
    with pytest.warns(HemlineWarning, match=said), pytest.raises(Stopped):
        make(tmp_path / "data", report=stop)
    # not even the drape that a clip starts from
    assert isinstance(next(rest_job(dataset, ours, ())), Call)
    with pytest.warns(HemlineWarning, match=said):
        rows = make(tmp_path / "data")
    assert [row.name for row in rows] == [row.name for row in made[1]]
    assert there < {path.name for path in dataset.takes_folder.iterdir()}
    assert len(dataset.rows()) == 6
