"""Bad input: exit status 2, one line on stderr (what, got, cure), nothing written."""

import pickle

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.cli import main
from hemline.cli.main import VERBS
from hemline.datasets import create

BVH = """HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
  End Site
  {
    OFFSET 0 1 0
  }
}
MOTION
Frames: 2
Frame Time: 0.0083333
0 0 0 0 0 0
0 0 0 0 0 0
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "one_joint.bvh").write_text(BVH)
    (tmp_path / "cut.bvh").write_text(BVH[:150])
    (tmp_path / "empty.bvh").write_text("")
    (tmp_path / "nan.obj").write_text("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "past.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")
    (tmp_path / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    (tmp_path / "triangle.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "model.safetensors").write_bytes(pickle.dumps({"weights": [1, 2]}))
    (tmp_path / "text.safetensors").write_text("not a model")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    return tmp_path


CASES = {
    "generate of no kind": (["generate", "kilt", "-o", "k.safetensors"], "use one of top"),
    "generate beyond a limit": (["generate", "skirt", "--flare", "9", "-o", "k.safetensors"], "from 0 to 0.8"),
    "generate by a negative seed": (["generate", "skirt", "--seed", "-1", "-o", "k.safetensors"], "seed"),
    "generate into an unknown format": (["generate", "skirt", "-o", "k.stl"], "k.safetensors"),
    "generated garment misspelt": (["simulate", "dress:x", "-m", "run", "-o", "d"], "KIND:SEED"),
    "no such verb": (["simulat", "x"], "did you mean 'simulate'"),
    "no such flag": (["animate", "cape", "--motions", "run"], "hemline animate"),
    "no motion": (["simulate", "cape-light", "-o", "d"], "hemline simulate"),
    "missing clip": (["simulate", "cape-light", "-m", "no.bvh", "-o", "d"], "no.bvh"),
    "clip without joints": (["simulate", "cape-light", "-m", "one_joint.bvh", "-o", "d"], "lacks the joint"),
    "truncated clip": (["simulate", "cape-light", "-m", "cut.bvh", "-o", "d"], "cut"),
    "empty clip": (["simulate", "cape-light", "-m", "empty.bvh", "-o", "d"], "empty.bvh"),
    "npz of something else": (["simulate", "cape-light", "-m", "other.npz", "-o", "d"], "other.npz"),
    "no such garment": (["simulate", "cap", "-m", "run", "-o", "d"], "cape"),
    "mesh with NaN": (["simulate", "nan.obj", "-m", "run", "-o", "d"], "NaN or infinity in 1 of 3"),
    "face past the last vertex": (["simulate", "past.obj", "-m", "run", "-o", "d"], "past.obj"),
    "no faces": (["simulate", "points.obj", "-m", "run", "-o", "d"], "points.obj"),
    "too many betas": (["simulate", "cape-light", "-m", "run", "-o", "d", "--betas", *["0"] * 17], "betas"),
    "gusts": (["simulate", "cape-light", "-m", "run", "-o", "d", "--gusts", "-1"], "'gusts' must not be negative"),
    "gust seed": (["simulate", "cape-light", "-m", "run", "-o", "d", "--gust-seed", "-1"], "a whole number"),
    "wind": (["simulate", "cape-light", "-m", "run", "-o", "d", "--wind", "1", "nan", "0"], "'wind' must be a vector"),
    "no such garment over": (
        ["simulate", "cape-light", "--over", "cap", "-m", "run", "-o", "d"],
        "did you mean 'cape'",
    ),
    "jobs": (["simulate", "cape-light", "-m", "run", "-o", "d", "--jobs", "0"], "--jobs must be at least 1"),
    "seconds": (["simulate", "cape-light", "-m", "run", "-o", "d", "--seconds", "-1"], "--seconds must be positive"),
    "spread": (["drape", "cape-light", "-o", "d", "--spread", "17"], "anny24 has 16 betas"),
    "random": (["drape", "cape-light", "-o", "d", "--random", "-1"], "--random must not be negative"),
    "drape of nothing": (["drape", "cap", "-o", "d"], "did you mean 'cape'"),
    "no such body": (["simulate", "cape-light", "-m", "run", "-o", "d", "--body", "anny25"], "anny24"),
    "no dataset": (["fit", "nothing", "-o", "m.safetensors"], "is no dataset"),
    "no folder for the model": (["fit", "nothing", "-o", "no/m.safetensors"], "cannot write"),
    "no such animator": (["fit", "nothing", "-o", "m.safetensors", "--animator", "rope"], "did you mean 'ropes'"),
    "fit of nothing": (["fit", "-o", "m.safetensors"], "name what 'hemline simulate' made"),
    "start past the end": (["animate", "cape", "-m", "run", "-o", "a.npz", "--start", "99"], "within the clip"),
    "no length": (["animate", "cape", "-m", "run", "-o", "a.npz", "--seconds", "0"], "--seconds must be positive"),
    "no threads": (["evaluate", "cape", "-m", "run", "--threads", "0"], "--threads must be at least 1"),
    "no such model": (["animate", "kape", "-m", "run", "-o", "a.npz"], "cape"),
    "pickle inside": (["animate", "model.safetensors", "-m", "run", "-o", "a.npz"], "pickle"),
    "no model at all": (["animate", "text.safetensors", "-m", "run", "-o", "a.npz"], "text.safetensors"),
    "a mesh as a model": (["animate", "triangle.obj", "-m", "run", "-o", "a.npz"], "--garment triangle.obj"),
    "format": (["animate", "cape", "-m", "run", "-o", "a.fbx"], ".glb"),
    "bones without a skin": (["animate", "cape", "-m", "run", "-o", "a.glb", "--bones", "9"], "alone; add --skinned"),
    "a skin in a cache": (["animate", "cape", "-m", "run", "-o", "a.pc2", "--skinned"], "no skinned garment"),
    "no bones": (["animate", "cape", "-m", "run", "-o", "a.glb", "--skinned", "--bones", "0"], "1 to 256 bones; got 0"),
    "arrays quantised": (["animate", "cape", "-m", "run", "-o", "a.npz", "--quantized"], "cannot be quantised"),
    "folder of the output": (["animate", "cape", "-m", "run", "-o", "no/a.glb"], "cannot write"),
    "no such excerpt": (["animate", "cape", "-m", "rum", "-o", "a.glb"], "run"),
    "drive truth without one": (["evaluate", "cape", "-m", "run", "--drive", "truth"], "--truth"),
    "truth that is none": (["evaluate", "cape", "-m", "run", "--truth", "nothing"], "is no dataset"),
    "nothing at all": (["simulate"], "simulate needs GARMENT and --motion and --output; got no arguments"),
    "a flag without its value": (["drape", "cape-light", "-o"], "drape: --output needs a value; got cape-light -o"),
    "seconds in words": (
        ["simulate", "cape-light", "-m", "run", "-o", "d", "--seconds", "ten"],
        "--seconds must be a number; got ten",
    ),
    "seconds that are none": (
        ["simulate", "cape-light", "-m", "run", "-o", "d", "--seconds", "nan"],
        "--seconds must be positive; got nan",
    ),
    "endless seconds": (["simulate", "cape-light", "-m", "run", "-o", "d", "--seconds", "inf"], "got inf"),
    "far too many frames": (["simulate", "cape-light", "-m", "run", "-o", "d", "--fps", "1e9"], "from 1 to 1000"),
    "betas in words": (
        ["simulate", "cape-light", "-m", "run", "-o", "d", "--betas", "tall"],
        "--betas must be a list of numbers; got tall",
    ),
    "betas that are none": (["simulate", "cape-light", "-m", "run", "-o", "d", "--betas", "nan"], "must be finite"),
    "betas of no body": (["simulate", "cape-light", "-m", "run", "-o", "d", "--betas", "1e9"], "from -20 to 20"),
    "half a wind": (["simulate", "cape-light", "-m", "run", "-o", "d", "--wind", "1", "2"], "--wind needs 3 values"),
    "no clips": (["simulate", "cape-light", "-m", "-o", "d"], "no clips"),
    "a clip without a name": (["simulate", "cape-light", "-m", "", "-o", "d"], "no motion of that name ships; got ''"),
    "a folder as a clip": (["simulate", "cape-light", "-m", "folder", "-o", "d"], "no motion of that name ships"),
    "a misspelt clip": (
        ["simulate", "cape-light", "-m", "rum", "-o", "d"],
        "the nearest name is 'run'; or name a .bvh",
    ),
    "a folder as a garment": (["simulate", "folder", "-m", "run", "-o", "d"], "unknown garment; got 'folder'"),
    "a folder that ends as a mesh": (["drape", "folder.obj", "-o", "d"], "cannot read folder.obj"),
    "a missing mesh": (["drape", "no.obj", "-o", "d"], "cannot read no.obj; got No such file"),
    "a mesh of no known kind": (["simulate", "skirt.fbx", "-m", "run", "-o", "d"], "no known mesh ending; got '.fbx'"),
    "a file as a dataset": (["drape", "cape-light", "-o", "empty.bvh"], "cannot make empty.bvh"),
    "a dataset in a file": (["simulate", "cape-light", "-m", "run", "-o", "empty.bvh/d"], "cannot make empty.bvh/d"),
    "a dataset nowhere": (["simulate", "cape-light", "-m", "run", "-o", "/proc/d"], "cannot make /proc/d"),
    "seed": (["drape", "cape-light", "-o", "d", "--seed", "-1"], "--seed must not be negative"),
    "spread in words": (["drape", "cape-light", "-o", "d", "--spread", "x"], "--spread must be a whole number; got x"),
    "a missing mesh to try on": (["tryon", "no.obj", "-o", "a.safetensors"], "cannot read no.obj"),
    "a misspelt garment to try on": (["tryon", "capee", "-o", "a.safetensors"], "did you mean 'cape'"),
    "a wrong ending": (["tryon", "past.obj", "-o", "a.obj"], "must end in .safetensors; got .obj"),
    "a picture of a wrong ending": (
        ["tryon", "past.obj", "-o", "a.safetensors", "--picture", "a.gif"],
        "must end in .png; got .gif",
    ),
    "an unknown unit": (["tryon", "triangle.obj", "-o", "a.safetensors", "--unit", "parsec"], "got 'parsec'; use one"),
    "a misspelt flag": (["export", "d", "--taek", "1", "--take", "1", "-o", "a.glb"], "did you mean '--take'"),
    "no take": (["export", "d", "-o", "a.glb"], "export needs --take; got d -o a.glb"),
    "a take in words": (["export", "d", "--take", "x", "-o", "a.glb"], "--take must be a whole number; got x"),
    "an unknown format": (["export", "d", "--take", "0", "-o", "a.fbx"], "got the ending '.fbx'; choose one of .glb"),
    "a take of a file": (["export", "empty.bvh", "--take", "0", "-o", "a.glb"], "is no dataset"),
    "export from nothing": (["export", "nothing", "--take", "0", "-o", "a.glb"], "is no dataset"),
    "no such benchmark": (["bench", "capes"], "projection-cape"),
}


@pytest.mark.parametrize("name", CASES)
def test_bad_input_is_one_line_status_two_and_nothing_written(folder, capsys, name):
    arguments, said = CASES[name]
    before = sorted(path.name for path in folder.rglob("*"))
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    *before_error, error = err.splitlines()
    assert error.startswith("hemline: ") and said in error, err
    assert [line.startswith(f"{arguments[0]}: ") for line in before_error] in ([], [True]), err
    assert sorted(path.name for path in folder.rglob("*")) == before


@pytest.mark.parametrize("take", ["1", "-1"])
def test_a_take_that_is_not_there(take, folder, capsys):
    garments.make_cape(bodies.load().shaped(), rows=6, columns=10, name="napkin").save("napkin.safetensors")
    create("data", garments.read("napkin.safetensors"))
    assert main(["export", "data", f"--take={take}", "-o", "a.glb"]) == 2
    assert f"data has no takes of clips; got --take {take}" in capsys.readouterr().err


def test_help_and_version(capsys):
    assert main(["--version"]) == 0
    assert main([]) == 0
    out = capsys.readouterr().out
    assert "hemline 0." in out and all(verb in out for verb in VERBS)


@pytest.mark.parametrize("verb", VERBS)
def test_each_verb_tells_its_flags(verb, capsys):
    with pytest.raises(SystemExit) as stop:
        main([verb, "--help"])
    assert stop.value.code in (0, None)
    assert f"hemline {verb}" in capsys.readouterr().out


def test_benchmarks_are_listed(capsys):
    assert main(["bench", "--list"]) == 0
    out = capsys.readouterr().out
    assert all(name in out for name in ("cape", "projection-cape", "sim-4k", "sim-12k"))


def test_figures_that_cannot_be_recorded_are_an_error_before_anything_is_timed(tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert main(["bench", "cape", "--record", str(tmp_path / "file")]) == 2
    assert "cannot write to" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "mine"
