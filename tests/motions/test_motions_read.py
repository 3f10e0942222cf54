import numpy as np
import pytest

from hemline import motions
from hemline.errors import BadMotion, BadOutput
from hemline.files import read_tensors, write_tensors
from hemline.motions.store import read_many, write_many
from tests.motions.bvh_samples import person, text_of


def test_what_was_written_is_read_back_to_the_bit(tmp_path):
    run = motions.load("run")
    motions.write(tmp_path / "run.safetensors", run)
    again = motions.read(tmp_path / "run.safetensors")
    assert again.hash == run.hash
    assert (again.name, again.source, again.licence, again.notes) == (run.name, run.source, run.licence, run.notes)
    write_many(tmp_path / "two.safetensors", {"a": run, "b": run[:3]})
    assert {key: motion.hash for key, motion in read_many(tmp_path / "two.safetensors").items()} == {
        "a": run.hash,
        "b": run[:3].hash,
    }


def test_bvh_comes_with_name_source_and_licence(tmp_path):
    path = tmp_path / "02_03.bvh"
    path.write_text(text_of(person(frames=3)))
    motion = motions.open_motion(path)
    assert (motion.name, motion.source) == ("02_03", "CMU 02_03, 02_03.bvh")
    assert "mocap.cs.cmu.edu" in motion.licence
    own = tmp_path / "my walk.BVH"
    own.write_text(text_of(person(frames=3)))
    assert (motions.read(own).source, motions.read(own).licence) == ("my walk.BVH", "")


def test_the_unit_can_be_declared(tmp_path):
    path = tmp_path / "child.bvh"
    path.write_text(text_of(person(frames=2)))
    assert motions.read(path, unit="cm").leg_length == pytest.approx(0.84)
    with pytest.raises(BadMotion, match="unit 'mm' contradicts the size of child"):
        motions.read(path, unit="mm")
    with pytest.raises(BadMotion, match="has its unit by its format; got unit 'cm'"):
        motions.read(tmp_path / "clip.npz", unit="cm")


def test_shipped_names_and_files_are_told_apart(tmp_path):
    assert motions.open_motion("kick").hash == motions.load("kick").hash
    with pytest.raises(BadMotion, match=r"cannot read .*run.bvh"):
        motions.open_motion(tmp_path / "run.bvh")
    with pytest.raises(BadMotion, match="no motion of that name ships; got 'runn'; the nearest name is 'run'"):
        motions.open_motion("runn")
    with pytest.raises(BadMotion, match="the nearest name is 'dance'"):
        motions.load("dancing")


def test_unknown_endings_are_refused(tmp_path):
    with pytest.raises(BadMotion, match=r"has no known ending; got '.abc'"):
        motions.read(tmp_path / "clip.abc")
    with pytest.raises(BadMotion, match=r"clips in .pkl files are not read; .*pickles can run code"):
        motions.read(tmp_path / "clip.pkl")
    with pytest.raises(BadOutput, match="no motion is written to .*; got the ending '.bvh'"):
        motions.write(tmp_path / "clip.bvh", motions.load("run"))
    assert not list(tmp_path.iterdir())


def test_damaged_motion_files_are_refused(tmp_path):
    path = tmp_path / "run.safetensors"
    motions.write(path, motions.load("run"))
    arrays, metadata = read_tensors(path, "motion")
    write_tensors(path, {"rotations": arrays["rotations"]}, metadata)
    with pytest.raises(BadMotion, match="lacks a part of a motion; got no 'translations'"):
        motions.read(path)
    write_tensors(path, arrays, {key: value for key, value in metadata.items() if key != "leg_length"})
    with pytest.raises(BadMotion, match="lacks a part of a motion; got no 'leg_length'"):
        motions.read(path)
    write_tensors(path, arrays, metadata | {"fps": "fast"})
    with pytest.raises(BadMotion, match="'fps' of .* has the wrong type; got 'fast'"):
        motions.read(path)
    write_tensors(path, arrays | {"translations": arrays["translations"] * np.float32(np.nan)}, metadata)
    with pytest.raises(BadMotion, match="'translations' must be finite"):
        motions.read(path)
    write_tensors(path, arrays, metadata | {"kind": "garment"})
    with pytest.raises(BadMotion, match="must be a motion file; got a garment file"):
        motions.read(path)


@pytest.mark.parametrize(
    ("clip", "subject"),
    [
        ("02_03.bvh", "02"),
        ("some/where/135_07.bvh", "135"),
        ("61_01.bvh", "60"),
        ("60_08.bvh", "60"),
        ("run", "02"),
        ("running_1.bvh", "running"),
        ("charleston1", "charleston"),
        ("my walk 2.bvh", "my walk"),
        ("12.bvh", "12"),
        ("running_1 looped x0.75", "running"),
        ("running_3 x1.5", "running"),
    ],
)
def test_subjects_by_name(clip, subject):
    """60 and 61 danced together, so they count as one."""
    assert motions.subject_of(clip) == subject


def test_the_subject_of_a_motion_is_that_of_its_source():
    assert motions.subject_of(motions.load("kick")) == "135"
