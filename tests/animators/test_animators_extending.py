"""The toy animator of docs/extending.md, installed as another package would install it."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

from hemline import animators, bodies, garments
from hemline.animators import registry
from hemline.animators.ropes import KIND
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
        return cls({"seed": float(seed)})

    @classmethod
    def of(cls, arrays, metadata):
        return cls(metadata["figures"])

    def worn_by(self, garment, body):
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
    assert back.figures == {"seed": 3.0}
    shaped = bodies.load("anny24").shaped()
    worn = back.worn_by(garments.load("cape-light"), shaped)
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
