"""The folder of a run: continued, never shared, never overwritten by another mesh."""

import json
import time

import pytest

from hemline.errors import BadOutput
from hemline.make.clock import Clock, OutOfTime
from hemline.make.job import Job
from hemline.make.settings import MakeSettings
from hemline.make.work_folder import inputs_hash, open_work_folder
from hemline.sim import SimSettings


def test_a_run_goes_on_where_it_stopped(tmp_path):
    model = tmp_path / "coat.safetensors"
    with open_work_folder(model, "abc") as first:
        assert first.fresh
        first.note(plan={"frames": 3})
        spent = first.spent_s
    with open_work_folder(model, "abc") as second:
        assert not second.fresh
        assert second.folder == tmp_path / "coat.making"
        assert second.state["plan"] == {"frames": 3}
        assert second.spent_s >= spent > 0


def test_a_mesh_that_changed_begins_anew_beside_the_old_one(tmp_path):
    model = tmp_path / "coat.safetensors"
    with open_work_folder(model, "abc") as old:
        old.note(plan={"frames": 3})
    with open_work_folder(model, "def") as new:
        assert new.fresh
        assert new.folder == tmp_path / "coat.making-2"
    with open_work_folder(model, "abc") as again:
        assert again.folder == old.folder
        assert again.state["plan"] == {"frames": 3}


def test_a_run_that_goes_on_without_self_contact_remembers_it(tmp_path):
    """The settled garment is stored, so that settling it again would no longer say that it is tangled."""
    with open_work_folder(tmp_path / "shorts.safetensors", "abc") as work:
        work.note(self_contact=False)
    with open_work_folder(tmp_path / "shorts.safetensors", "abc") as work:
        run = Job(MakeSettings(), 1, None, [], None, None, None, None, SimSettings(), work, None, None)  # type: ignore
        assert run.adapt_simulation().simulation == SimSettings(self_contact=False)


def test_two_runs_do_not_share_a_folder(tmp_path):
    model = tmp_path / "coat.safetensors"
    with (
        open_work_folder(model, "abc"),
        pytest.raises(BadOutput, match="another run works in"),
        open_work_folder(model, "abc"),
    ):
        pass


@pytest.mark.parametrize("content", ["", "{", "[]", '{"version": 1}', json.dumps({"version": 9, "inputs": "abc"})])
def test_a_folder_whose_state_cannot_be_read_is_left_alone(tmp_path, content):
    model = tmp_path / "coat.safetensors"
    folder = tmp_path / "coat.making"
    folder.mkdir()
    (folder / "make.json").write_text(content)
    with open_work_folder(model, "abc") as new:
        assert new.folder == tmp_path / "coat.making-2"
    assert (folder / "make.json").read_text() == content


def test_inputs_are_the_bytes_of_the_mesh_and_what_is_said_of_it(tmp_path):
    mesh = tmp_path / "a.obj"
    mesh.write_text("v 0 0 0\n")
    first = inputs_hash(str(mesh), {"material": None})
    assert inputs_hash(str(mesh), {"material": "silk"}) != first
    assert inputs_hash(f"{mesh}:Shirt", {"material": None}) != first
    (tmp_path / "a.toml").write_text("unit = 'cm'\n")
    assert inputs_hash(str(mesh), {"material": None}) != first
    (tmp_path / "a.toml").unlink()
    assert inputs_hash(str(mesh), {"material": None}) == first
    mesh.write_text("v 0 0 1\n")
    assert inputs_hash(str(mesh), {"material": None}) != first


def test_a_step_is_stopped_when_its_time_is_over(tmp_path):
    calls = []
    with open_work_folder(tmp_path / "my.safetensors", "x") as work:
        clock = Clock(60.0, work, lambda line: None)
        patient = clock.stop_late(lambda *step: calls.append(step), 60.0)
        hasty = clock.stop_late(lambda *step: calls.append(step), 0.05)
        patient("a", 1, 2)
        time.sleep(0.1)
        patient("a", 2, 2)
        with pytest.raises(OutOfTime, match="b"):
            hasty("b", 1, 2)
    assert calls == [("a", 1, 2), ("a", 2, 2), ("b", 1, 2)]
