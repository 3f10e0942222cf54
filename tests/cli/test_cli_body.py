"""`hemline body`, `--body` and `--character`: from a rigged character to a GLB in which it moves with a garment."""

import json
from dataclasses import replace

import numpy as np
import pygltflib
import pytest

from hemline import bodies, garments
from hemline.cli import main
from tests.bodies.character_samples import CUSTOMS, Sample, write_character


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    turns = np.tile([1.0, 0, 0, 0], (7, 24, 1))
    clips = {"stand": (np.arange(7) / 30, turns)}
    write_character(tmp_path / "me.glb", Sample(names=CUSTOMS["unreal"], scale=100, clips=clips))
    return tmp_path


def test_a_body_is_made_and_what_was_found_is_said(folder, capsys):
    assert main(["body", "me.glb", "-o", "me.safetensors", "--picture", "me.png"]) == 0
    out, err = capsys.readouterr()
    assert out == "me.safetensors\n"
    for said in ("joints found by the names", "unit cm, guessed", "its own skin, 'Body'", "animations: stand"):
        assert said in err
    assert (folder / "me.png").stat().st_size > 1000
    assert bodies.load("me.safetensors").hash == bodies.load("me.glb").hash
    assert main(["body", "me.glb", "-o", "small.safetensors", "--height", "1.4", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["height_m"] == pytest.approx(1.4, abs=1e-4) and said["vertices"] == 3000


def test_it_is_simulated_and_exported_with_its_own_mesh(folder, capsys):
    assert main(["body", "me.glb", "-o", "me.safetensors"]) == 0
    cape = garments.make_cape(bodies.load("me.safetensors").shaped(), rows=12, columns=24, name="napkin")
    cape.save("napkin.safetensors")
    asked = ["-m", "me.glb:stand", "--body", "me.safetensors", "-o", "takes"]
    assert main(["simulate", "napkin.safetensors", *asked]) == 0
    take = ["export", "takes", "--take", "0", "--character", "me.glb"]
    assert main([*take, "-o", "dressed.glb"]) == 0
    document = pygltflib.GLTF2().load("dressed.glb")
    assert {mesh.name for mesh in document.meshes} == {"Body", "napkin"}
    assert [each.name for each in document.animations] == ["clip"]
    capsys.readouterr()
    assert main([*take, "-o", "dressed.obj"]) == 2
    assert "a character's own mesh is written as .glb; got dressed.obj" in capsys.readouterr().err
    write_character(folder / "other.glb", Sample(body=_longer(), scale=1))
    assert main([*take[:-1], "other.glb", "-o", "other_dressed.glb"]) == 2
    assert "was not made of other.glb; got joints that are" in capsys.readouterr().err
    assert not (folder / "other_dressed.glb").exists()


def _longer():
    body = Sample().body
    wider = np.array([1.3, 1, 1], np.float32)
    return replace(body, template=body.template * wider, joints=body.joints * wider)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["body", "me.glb", "-o", "me.glb"], "me.glb must end in .safetensors; got .glb"),
        (["body", "absent.glb", "-o", "a.safetensors"], "cannot read absent.glb; got No such file"),
        (["body", "b.safetensors", "-o", "a.safetensors", "--unit", "cm"], "--height and --unit are for .glb"),
        (["simulate", "cape-light", "-m", "me.glb:jump", "-o", "t"], "has no animation 'jump'; got stand; name one"),
        (["animate", "cape", "-m", "me.glb:stand"], "the name of the output is needed where the clip is in a GLB"),
        (["drape", "cape-light", "-o", "t", "--body", "me.glb", "--spread", "1"], "has 0 betas; got 1; give fewer"),
        (
            ["drape", "napkin.safetensors", "-o", "t", "--body", "me.glb", "--anchors", "2", "-m", "run"],
            "anchors are for bodies of many shapes; got 'me.glb', which has no betas",
        ),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(words, said, folder, capsys):
    if "napkin.safetensors" in words:
        garments.make_cape(bodies.load("me.glb").shaped(), rows=6, columns=10).save("napkin.safetensors")
    assert main(words) == 2
    out, err = capsys.readouterr()
    *_, error = err.splitlines()  # after the line that says what is being done
    assert out == "" and said in error
