"""`hemline make` from a garment to a model and its report."""

import base64
import json
import re
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import hemline
from hemline.cli.main import main
from hemline.datasets import open_dataset
from hemline.errors import BadInput, SimulationFailed
from hemline.files import read_metadata
from hemline.make import MakeSettings, make_model

GARMENT = "close-skirt:3@50"
NO_TIME = 0.01
"""Minutes in which nothing can be simulated for a fit, on the fastest machine."""


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    lines = []
    settings = MakeSettings(minutes=NO_TIME, seconds=0.7)
    made = make_model(GARMENT, tmp_path_factory.mktemp("make") / "my.safetensors", settings, say=lines.append)
    return made, lines


def test_methods_that_need_no_data_are_compared_when_time_is_short(outcome):
    made, lines = outcome
    assert {trial.method for trial in made.trials} == {"skinned", "lag", "swingar", "live"}
    assert any("Not compared: ropes needs about" in line for line in lines)
    assert any(re.search(r"\d+ % of the cloth hangs", line) for line in lines)
    rivals = [trial.error_mm for trial in made.trials if trial.frame_ms <= MakeSettings().ms and trial.skin_seen < 0.1]
    assert not rivals or made.chosen.error_mm <= 1.06 * min(rivals)
    for trial in made.trials:
        assert 0.5 < trial.error_mm < 200
        assert trial.inside == 0
        assert trial.frame_ms > 0
    assert 0 < made.truth.stretch_p99 < 30


def test_the_model_plays_and_carries_the_table_of_its_choice(outcome):
    made, _ = outcome
    table = read_metadata(made.model, "model")["made"]
    assert table["chosen"] == made.chosen.method
    assert {trial["method"]: trial["error_mm"] for trial in table["trials"]} == {
        trial.method: trial.error_mm for trial in made.trials
    }
    animator = hemline.load(made.model)
    assert animator.name == made.chosen.method
    frames = list(hemline.play(animator, hemline.bodies.load("anny24").shaped(), hemline.motions.load("walk")[:5]))
    assert np.isfinite(frames[-1].vertices).all()


def test_the_report_opens_without_a_network_and_shows_real_pictures(outcome):
    made, _ = outcome
    page = made.report.read_text()
    assert "http" not in page.replace("http-equiv", "")
    pictures = [base64.b64decode(each) for each in re.findall(r"data:image/\w+;base64,([^']+)'", page)]
    assert len(pictures) >= 3
    assert all(picture[:4] in (b"RIFF", b"\x89PNG") and len(picture) > 5000 for picture in pictures)
    for trial in made.trials:
        assert f"<td>{trial.method}</td><td>{trial.error_mm:.1f}</td>" in page
    assert f"hemline animate {made.model}" in page


def test_its_folder_holds_datasets_that_fit_takes(outcome):
    made, _ = outcome
    check = open_dataset(made.folder / "check")
    assert [row.clip for row in check.clips()] == ["dance"]
    assert open_dataset(made.folder / "probe").garment.hash == check.garment.hash


@pytest.mark.slow
def test_a_fit_for_which_no_time_is_left_is_left_out_with_the_reason(outcome, tmp_path):
    made, _ = outcome
    folder, model = tmp_path / "my.making", tmp_path / "my.safetensors"
    shutil.copytree(made.folder, folder)
    state = json.loads((folder / "make.json").read_text())
    state["plan"] |= {"methods": ["ropes", "skinned", "lag", "swingar", "live"], "frames": 60, "left_out": []}
    (folder / "make.json").write_text(json.dumps(state))
    lines = []
    again = make_model(GARMENT, model, MakeSettings(minutes=NO_TIME, seconds=0.7), say=lines.append)
    assert {trial.method for trial in again.trials} == {"skinned", "lag", "swingar", "live"}
    assert any(re.match("Not compared: ropes needs about .* for a fit, and 0 s are left", line) for line in lines)
    assert "ropes needs about" in again.report.read_text()
    assert not list((folder / "takes" / "takes").glob("*.safetensors"))


def test_a_method_without_time_for_it_ends_with_the_reason(tmp_path):
    with pytest.raises(SimulationFailed, match="no method can play this garment: ropes needs about"):
        make_model(GARMENT, tmp_path / "my.safetensors", MakeSettings(minutes=NO_TIME, seconds=0.7, animator="ropes"))


@pytest.mark.slow
def test_a_second_run_makes_nothing_again(outcome):
    made, _ = outcome
    takes = {file: file.stat().st_mtime_ns for file in made.folder.rglob("*.safetensors") if "takes" in str(file)}
    again = make_model(GARMENT, made.model, MakeSettings(minutes=NO_TIME, seconds=0.7))
    assert {file: file.stat().st_mtime_ns for file in takes} == takes
    assert again.seconds > made.seconds
    assert {trial.method: trial.error_mm for trial in again.trials} == {
        trial.method: trial.error_mm for trial in made.trials
    }


@pytest.mark.slow
def test_a_killed_run_goes_on(tmp_path):
    command = [sys.executable, "-m", "hemline", "make", GARMENT, "-o", "my.safetensors", "--minutes", "1", "--json"]
    running = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    probe = tmp_path / "my.making" / "probe" / "takes"
    for _ in range(600):
        if probe.is_dir() and len(list(probe.iterdir())) >= 2:
            break
        time.sleep(0.2)
    running.send_signal(signal.SIGKILL)
    running.wait()
    before = {file.name: file.stat().st_mtime_ns for file in probe.glob("*.safetensors")}
    assert before
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert "Continuing in" in done.stderr
    assert json.loads(done.stdout)["chosen"] in ("skinned", "lag", "swingar", "live", "agentdress", "ropes")
    assert {name: (probe / name).stat().st_mtime_ns for name in before} == before


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--minutes", "0"], "'minutes' must be positive"),
        (["--ms", "-1"], "'ms' must be positive"),
        (["--jobs", "0"], "--jobs must be at least 1"),
        (["--animator", "magic"], "no such method"),
        (["-m", "dance"], "clips must differ"),
        (["-m", "nowhere.bvh"], "nowhere.bvh"),
    ],
)
def test_bad_options_are_refused_before_anything_is_written(tmp_path, monkeypatch, capsys, words, message):
    monkeypatch.chdir(tmp_path)
    assert main(["make", GARMENT, "-o", "my.safetensors", *words]) == 2
    assert message in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_model_of_another_ending_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["make", GARMENT, "-o", "my.glb"]) == 2
    assert ".safetensors" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_settings_name_what_there_is():
    with pytest.raises(BadInput, match="name one of agentdress, ropes, skinned, lag, swingar, live"):
        MakeSettings(animator="rope")
