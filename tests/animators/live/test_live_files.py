"""`live` by name, in files, on the command line, and what it refuses."""

from dataclasses import asdict

import numpy as np
import pytest

import hemline
from hemline import animators, garments
from hemline.animators.live import KIND, Live, LiveConfig
from hemline.animators.live.config import QUALITY_LEVELS
from hemline.cli.main import main
from hemline.errors import BadInput, BadModel
from hemline.files import read_tensors, write_tensors
from hemline.files.tensors import tensor_bytes
from hemline.models.make.terms import add_terms, read_contents
from tests.animators import made_coarse as made


def test_it_is_known_by_its_name_and_needs_no_fit(tmp_path):
    live = hemline.load("live")
    assert isinstance(live, animators.Wearable) and not isinstance(live, animators.Animator)
    assert (live.name, dict(live.figures), live) == ("live", {}, Live())
    live.save(tmp_path / "live.safetensors")
    arrays, metadata = read_contents(tmp_path / "live.safetensors")
    made = tensor_bytes(arrays, add_terms("live", metadata))
    assert made == animators.model_path("live").read_bytes(), "python -m hemline.models.make.terms --unfitted"


def test_options_travel_in_a_file(tmp_path):
    windy = Live(LiveConfig(wind=(1.0, 0.0, -3.0), quality="exact", self_contact=True))
    windy.save(tmp_path / "windy.safetensors")
    assert hemline.load(tmp_path / "windy.safetensors") == windy


def test_a_fit_is_refused():
    with pytest.raises(BadInput, match=r"'live' learns nothing; got a fit; play it: hemline animate live --garment"):
        KIND.fit(None)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"edge": 0.0}, "option 'edge' must be positive"),
        ({"most": 0}, "option 'most' must be positive"),
        (
            {"quality": "best"},
            "option 'quality' must be one of a few; got 'best'; use one of budget, fast, good, fine, exact",
        ),
        (
            {"quality": "fine", "self_contact": True},
            "self-contact is simulated by quality 'exact' alone; got quality 'fine'",
        ),
        ({"budget_ms": -1.0}, "option 'budget_ms' must be positive"),
        ({"wind": (1.0, float("nan"), 0.0)}, "option 'wind' must be a vector"),
        ({"gusts": -1.0}, "option 'gusts' must not be negative"),
    ],
)
def test_options_that_make_no_sense_are_refused(options, complaint):
    with pytest.raises(BadInput, match=complaint):
        LiveConfig(**options)


def test_a_budget_buys_the_best_level_that_it_can_pay():
    level = LiveConfig().level
    assert level(1500) == QUALITY_LEVELS["fine"]
    assert LiveConfig(budget_ms=5.0).level(1000) == QUALITY_LEVELS["good"]
    assert LiveConfig(budget_ms=1.0).level(1500) == QUALITY_LEVELS["fast"]
    assert LiveConfig(quality="fine", budget_ms=1.0).level(1500) == QUALITY_LEVELS["fine"]
    costs = [LiveConfig.cost_ms(each, 1000) for each in QUALITY_LEVELS.values()]
    assert costs == sorted(costs, reverse=True)


def changed(path, arrays=(), metadata=()):
    old_arrays, old_metadata = read_tensors(path, "model")
    kept = {name: value for name, value in (old_metadata | dict(metadata)).items() if value is not None}
    write_tensors(path, old_arrays | dict(arrays), kept)
    return path


@pytest.mark.parametrize(
    ("arrays", "metadata", "complaint"),
    [
        ({"rest": np.zeros((7, 3), np.float32)}, {}, "array 'rest' of the model must be float32"),
        ({}, {"live": None}, "lacks metadata 'live'"),
        ({}, {"live": {"version": 2}}, "reads version 1 of live garments; got version 2"),
        ({}, {"live": {"version": 1, "close": 1}}, "'close' of a live garment must be true or false; got 1"),
        ({}, {"config": asdict(made.SMALL) | {"edge": -1.0}}, "option 'edge' must be positive"),
        ({}, {"config": {"edges": 1.0}}, r"unknown option 'edges'; got 1.0; did you mean 'edge'\?"),
        ({}, {"config": None}, "lacks metadata 'config'"),
    ],
)
def test_damaged_files_are_refused(tmp_path, arrays, metadata, complaint):
    made.live_cape().save(tmp_path / "cape.safetensors")
    with pytest.raises(BadModel, match=complaint):
        hemline.load(changed(tmp_path / "cape.safetensors", arrays, metadata))


def test_the_page_on_formats_names_what_its_file_holds(tmp_path):
    from pathlib import Path

    made.live_cape().save(tmp_path / "cape.safetensors")
    text = (Path(__file__).parents[3] / "docs" / "format.md").read_text().split("### `live`")[1].split("\n### ")[0]
    arrays, metadata = read_tensors(tmp_path / "cape.safetensors", "model")
    assert [name for name in arrays if not name.startswith("garment.")] == ["rest"] and "| `rest` | f32 [C 3] |" in text
    assert metadata["live"] == {"version": 1, "close": False} and "JSON `live` contains `version` (1" in text


def test_the_commands_play_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made.live_cape().garment.save("cape.safetensors")
    Live(made.SMALL).save("small.safetensors")
    short = ["--garment", "cape.safetensors", "-m", "run", "--seconds", "0.1"]
    assert main(["animate", "small.safetensors", *short, "-o", "cape.npz"]) == 0
    assert np.load("cape.npz")["vertices"].shape == (4, len(made.live_cape().garment.vertices), 3)
    assert main(["animate", "live", "-m", "run", "-o", "cape.npz"]) == 2
    assert "model 'live' needs a garment to wear; got none; name one with --garment" in capsys.readouterr().err


def test_the_commands_play_one_garment_over_another(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made.live_cape().garment.save("cape.safetensors")
    Live(made.SMALL).save("small.safetensors")
    two = ["--garment", "tshirt-light", "--over", "cape.safetensors"]
    assert main(["animate", "small.safetensors", *two, "-m", "run", "--seconds", "0.1", "-o", "two.npz"]) == 0
    count = len(garments.load("tshirt-light").vertices) + len(made.live_cape().garment.vertices)
    assert np.load("two.npz")["vertices"].shape == (4, count, 3)
    assert main(["animate", "cape", "--over", "skirt-light", "-m", "run", "-o", "no.npz"]) == 2
    assert "got garment skirt-light; fit an animator to that garment, or play both by live" in capsys.readouterr().err
