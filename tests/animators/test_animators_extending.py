"""The toy animator of docs/extending.md, installed as another package would install it."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hemline import animators, bodies, garments
from hemline.animators import registry
from hemline.animators.ropes import KIND
from hemline.datasets import Take, create
from hemline.errors import BadInput, BadModel
from hemline.motions import Motion

PAGE = Path(__file__).parents[2] / "docs" / "extending.md"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A package of one module with an entry point, on the path."""
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (tmp_path / "my_package.py").write_text(code)
    (tmp_path / "my_package-1.0.dist-info").mkdir()
    (entry,) = re.findall(r"```toml\n\[project.entry-points.\"(.*?)\"\]\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (tmp_path / "my_package-1.0.dist-info" / "entry_points.txt").write_text(
        f"[{entry[0]}]\n{entry[1].replace(chr(34), '')}"
    )
    (tmp_path / "my_package-1.0.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: my_package\nVersion: 1.0\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    registry._places.cache_clear()
    yield
    registry._places.cache_clear()
    sys.modules.pop("my_package", None)
    sys.modules.pop("loose_package", None)


class SmallDataset:
    """What a fit reads of a dataset, with a rest drape only."""

    def __init__(self):
        self.garment = garments.load("cape-light")

    def rest(self, betas):
        return type("Rest", (), {"vertices": self.garment.vertices[None]})


def rest_take(garment, shaped) -> Take:
    """The garment as it was made, in the place of a drape: the toy needs no more."""
    pose = shaped.rest_pose
    still = Motion(pose.rotations[None], pose.translation[None], fps=30.0, leg_length=shaped.leg_length, name="rest")
    return Take(
        kind="rest",
        vertices=garment.vertices[None],
        motion=still,
        betas=shaped.betas,
        lead_in=np.zeros(1, bool),
        pinched=np.zeros(1, np.int32),
        figures={},
        inputs={"garment": garment.hash},
    )


def test_the_toy_is_fitted_saved_loaded_and_played(installed, tmp_path):
    assert "stiff" in animators.animator_names()
    toy = animators.fit(SmallDataset(), "stiff")
    toy.save(tmp_path / "toy.safetensors")
    back = animators.load(tmp_path / "toy.safetensors")
    assert isinstance(back, animators.Animator)
    shaped = bodies.load("anny24").shaped()
    rest = shaped.posed(shaped.rest_pose)
    _, vertices = back.step(back.start(rest), rest, 1 / 30)
    np.testing.assert_allclose(vertices, back.garment.vertices, atol=1e-5)
    assert back.name == "stiff" and back.config == toy.config and back.figures == toy.figures


def test_the_toy_is_a_kind_and_an_animator_without_more_capabilities(installed):
    kind = animators.animator_kind("stiff")
    assert isinstance(kind, animators.AnimatorKind)
    toy = animators.fit(SmallDataset(), "stiff", kind.Config(size=2.0))
    assert isinstance(toy, animators.Animator)
    assert not isinstance(toy, animators.Driven) and not isinstance(toy, animators.Wearable)
    np.testing.assert_array_equal(toy.rest, 2 * toy.garment.vertices)


def test_the_toy_refuses_options_that_make_no_sense(installed, tmp_path):
    from hemline.files import read_tensors, write_tensors

    with pytest.raises(BadInput, match="option 'size' must be positive; got 0.0; give a finite number above 0"):
        animators.animator_kind("stiff").Config(size=0.0)
    animators.fit(SmallDataset(), "stiff").save(tmp_path / "toy.safetensors")
    arrays, metadata = read_tensors(tmp_path / "toy.safetensors", "model")
    write_tensors(tmp_path / "bad.safetensors", arrays, metadata | {"config": {"sise": 1.0}})
    with pytest.raises(BadModel, match="bad.safetensors: unknown option 'sise'; got 1.0; did you mean 'size'"):
        animators.load(tmp_path / "bad.safetensors")


def test_the_toy_refuses_a_damaged_file(installed, tmp_path):
    from hemline.files import read_tensors, write_tensors

    toy = animators.fit(SmallDataset(), "stiff")
    toy.save(tmp_path / "toy.safetensors")
    arrays, metadata = read_tensors(tmp_path / "toy.safetensors", "model")
    write_tensors(tmp_path / "bad.safetensors", arrays | {"rest": arrays["rest"][:-1]}, metadata)
    with pytest.raises(BadModel, match=r"bad.safetensors: array 'rest' of the model must be float32 \(4000, 3\)"):
        animators.load(tmp_path / "bad.safetensors")


def test_the_toy_can_be_played_with_the_projection(installed):
    from hemline.playback import play

    toy = animators.fit(SmallDataset(), "stiff")
    shaped = bodies.load("anny24").shaped()
    pose = shaped.rest_pose
    still = Motion(
        np.stack([pose.rotations] * 3), np.stack([pose.translation] * 3), fps=30.0, leg_length=shaped.leg_length
    )
    frames = list(play(toy, shaped, still))
    assert [frame.vertices.shape for frame in frames] == [(4000, 3)] * 3
    with pytest.raises(BadInput, match="animator 'stiff' is not driven by ground truth"):
        next(play(toy, shaped, still, truth=np.zeros((3, 4000, 3), np.float32)))


def test_a_lazy_kind_imports_its_functions_when_they_are_called():
    kind = animators.LazyKind("lazy", dict, fit="hemline.nowhere:fit", of="builtins:dict.fromkeys")
    assert isinstance(kind, animators.AnimatorKind)
    assert kind.of(["rest"], {"version": 1}) == {"rest": {"version": 1}}
    with pytest.raises(ModuleNotFoundError, match="hemline.nowhere"):
        kind.fit(None)
    other = animators.LazyKind("other", dict, fit=lambda data, config, **options: (data, options), of="builtins:dict")
    assert other.fit("data", seed=3) == ("data", {"seed": 3, "progress": None, "checkpoints": None})


def test_an_unknown_animator_is_named_with_the_nearest():
    with pytest.raises(BadInput, match=r"no such animator; got 'rope'; .*did you mean 'ropes'\?"):
        animators.animator_kind("rope")
    with pytest.raises(BadModel, match="no such animator"):
        animators.animator_kind("xyz", error=BadModel)


WEARABLE = """
from dataclasses import dataclass

from my_package import AnimatorStiff, StiffConfig
from hemline.animators.model_file import save_model


@dataclass(frozen=True)
class WearableStiff:
    figures: dict
    name, Config = "loose", StiffConfig

    @classmethod
    def fit(cls, data, config=None, *, seed=0, progress=None, checkpoints=None):
        return cls({"seed": float(seed), "garments": len(data.garments) if data else 0})

    @classmethod
    def of(cls, arrays, metadata):
        return cls(metadata["figures"])

    def animator_for(self, garment, body):
        return AnimatorStiff(garment, body.body.name, body.body.hash, garment.vertices)

    def save(self, path):
        save_model(path, self.name, {}, garment=None, body={}, config={}, figures=self.figures, licences=[], extra={})
"""


def test_a_wearable_is_loaded_and_given_a_garment(installed, tmp_path):
    (tmp_path / "loose_package.py").write_text(WEARABLE)
    (tmp_path / "loose-1.0.dist-info").mkdir()
    (tmp_path / "loose-1.0.dist-info" / "entry_points.txt").write_text(
        "[hemline.animators]\nloose = loose_package:WearableStiff\n"
    )
    (tmp_path / "loose-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: loose\nVersion: 1.0\n")
    registry._places.cache_clear()
    animators.fit(None, "loose", seed=3).save(tmp_path / "loose.safetensors")
    back = animators.load(tmp_path / "loose.safetensors")
    assert isinstance(back, animators.Wearable) and not isinstance(back, animators.Animator)
    assert back.figures == {"seed": 3.0, "garments": 0}
    shaped = bodies.load("anny24").shaped()
    worn = back.animator_for(garments.load("cape-light"), shaped)
    assert isinstance(worn, animators.Animator)
    posed = shaped.posed(shaped.rest_pose)
    _, vertices = worn.step(worn.start(posed), posed, 1 / 30)
    np.testing.assert_allclose(vertices, worn.garment.vertices, atol=1e-5)


def test_no_entry_point_replaces_an_animator_of_ours(tmp_path, monkeypatch):
    (tmp_path / "other-1.0.dist-info").mkdir()
    (tmp_path / "other-1.0.dist-info" / "entry_points.txt").write_text("[hemline.animators]\nropes = other:Ropes\n")
    (tmp_path / "other-1.0.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: other\nVersion: 1.0\n")
    monkeypatch.syspath_prepend(tmp_path)
    registry._places.cache_clear()
    assert animators.animator_kind("ropes") is KIND
    registry._places.cache_clear()


def test_the_toy_is_fitted_animated_and_evaluated_from_the_command_line(installed, tmp_path):
    """In a process of its own, as a user of the other package would."""
    shaped = bodies.load("anny24").shaped()
    napkin = garments.make_cape(shaped, rows=12, columns=24, name="napkin")
    create(tmp_path / "rests", napkin).add(rest_take(napkin, shaped))

    def hemline(*words):
        path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
        command = [sys.executable, "-m", "hemline", *words]
        environment = os.environ | {"PYTHONPATH": path}
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)

    told = hemline("fit", "--animator", "stiff", "--help").stdout
    assert "--size" in told and "--calibrate" not in told
    fitted = hemline("fit", "rests", "--animator", "stiff", "--size", "1.5", "-o", "stiff.safetensors")
    assert fitted.returncode == 0, fitted.stderr
    model = animators.load(tmp_path / "stiff.safetensors")
    assert model.name == "stiff" and model.config.size == 1.5
    animated = hemline("animate", "stiff.safetensors", "-m", "run", "--seconds", "0.2", "-o", "run.npz")
    assert animated.returncode == 0, animated.stderr
    assert np.load(tmp_path / "run.npz")["vertices"].shape == (7, 288, 3)
    judged = hemline("evaluate", "stiff.safetensors", "-m", "run", "--start", "0.1", "--seconds", "0.2", "--json")
    assert judged.returncode == 0, judged.stderr
    figures = json.loads(judged.stdout)
    assert (figures["animator"], figures["frames"], figures["inside_percent"]["after"]) == ("stiff", 7, 0)
    refused = hemline("fit", "rests", "--animator", "stif", "-o", "no.safetensors")
    assert refused.returncode == 2 and "did you mean 'stiff'?" in refused.stderr
    assert not (tmp_path / "no.safetensors").exists()
    unknown = hemline("fit", "rests", "--animator", "stiff", "--epochs", "3", "-o", "no.safetensors")
    assert unknown.returncode == 2 and "--epochs" in unknown.stderr


def test_what_simulated_vertices_cannot_drive_says_so(installed):
    from hemline.playback import Player

    toy = animators.fit(SmallDataset(), "stiff")
    shaped = bodies.load("anny24").shaped()
    player = Player.prepare(toy, shaped)
    state = player.start(shaped.rest_pose)
    with pytest.raises(BadInput, match="animator 'stiff' is not driven by ground truth"):
        player.follow(state, shaped.rest_pose, 1 / 30, toy.rest)


def test_a_model_of_many_garments_is_fitted_on_a_collection_and_worn_by_a_new_one(installed, tmp_path, capsys):
    from hemline.cli import main

    (tmp_path / "loose_package.py").write_text(WEARABLE)
    (tmp_path / "my_package-1.0.dist-info" / "entry_points.txt").write_text(
        "[hemline.animators]\nloose = loose_package:WearableStiff\n"
    )
    registry._places.cache_clear()
    shaped = bodies.load("anny24").shaped()
    for rows in (8, 10, 12):
        create(tmp_path / f"d{rows}", garments.make_cape(shaped, rows=rows, columns=24, name=f"cape{rows}"))
    garments.make_cape(shaped, rows=14, columns=24, name="new").save(tmp_path / "new.safetensors")
    folders = [str(tmp_path / f"d{rows}") for rows in (8, 10, 12)]
    model, new, out = (str(tmp_path / name) for name in ("many.safetensors", "new.safetensors", "out.npz"))
    assert main(["fit", *folders, "--animator", "loose", "-o", model]) == 0
    assert isinstance(animators.load(model), animators.Wearable)
    assert animators.load(model).figures["garments"] == 3
    assert main(["animate", model, "--garment", new, "-m", "run", "--seconds", "0.1", "-o", out]) == 0
    assert np.load(out)["vertices"].shape == (4, 14 * 24, 3)
    assert main(["evaluate", model, "-m", "run", "--seconds", "0.1"]) == 2
    assert "needs a garment to wear; got none; name one with --garment" in capsys.readouterr().err
    assert main(["animate", "cape", "--garment", new, "-m", "run", "-o", out]) == 2
    assert "has its own garment, cape" in capsys.readouterr().err
    assert main(["fit", *folders, "--animator", "ropes", "-o", model]) == 2
    assert "rope chains are fitted to one garment; got cape8, cape10, cape12" in capsys.readouterr().err
