"""The verbs on what ships, and the whole loop from nothing on a napkin."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.cli import main
from hemline.cli.output import Output
from hemline.datasets import open_dataset
from hemline.export import Clip
from hemline.springs import search


@pytest.fixture
def short(tmp_path, monkeypatch):
    """A clip of half a second, as a file."""
    monkeypatch.chdir(tmp_path)
    motions.write(tmp_path / "short.safetensors", motions.load("run")[:16])
    return "short.safetensors"


def test_animate_writes_plain_arrays(short, capsys):
    assert main(["animate", "cape", "-m", short, "-o", "out.npz"]) == 0
    with np.load("out.npz", allow_pickle=False) as clip:
        assert set(clip.files) == {"vertices", "faces", "body_vertices", "body_faces", "fps", "notices"}
        assert "may not resell this data directly" in " ".join(clip["notices"].reshape(-1).tolist())
        assert clip["vertices"].shape == (16, 12690, 3) and clip["body_vertices"].shape == (16, 13348, 3)
        assert float(clip["fps"]) == 30
    assert capsys.readouterr().out.strip() == "out.npz"


def test_a_garment_without_a_model_is_played_by_live(short, capsys):
    assert main(["animate", "--garment", "top:0@50", "-m", short, "-o", "one.glb"]) == 0
    assert main(["animate", "live", "--garment", "top:0@50", "-m", short, "-o", "other.glb"]) == 0
    assert Path("one.glb").read_bytes() == Path("other.glb").read_bytes()
    assert main(["animate", "-m", short]) == 2
    said = capsys.readouterr().err
    assert "a model to play, or a garment to wear, is needed; got neither; name MODEL, or --garment FILE" in said


def test_a_skinned_garment_tells_how_far_it_is_from_the_played_one(short, capsys):
    asked = ["animate", "cape", "-m", short, "-o", "out.glb", "--skinned", "--quantized", "--bones", "20"]
    assert main([*asked, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == ["out.glb"] and said["bytes"] < 2e6
    assert (said["vertices"], said["frames"], said["skin"]["bones"]) == (12690, 16, 20)
    assert 0 < said["skin"]["mean_error_mm"] < 15 and said["skin"]["max_error_mm"] < 200


def test_the_error_of_a_skin_is_said_beside_the_names_of_the_files(tmp_path, capsys):
    frames = np.random.default_rng(0).normal(size=(3, 30, 3)).astype(np.float32)
    Output(tmp_path / "a.glb", True, 4, False).write(Clip(frames, np.array([[0, 1, 2]]), 30.0), as_json=False)
    shown = capsys.readouterr()
    assert shown.out == f"{tmp_path / 'a.glb'}\n" and "4 bones move the garment within" in shown.err


def test_evaluate_prints_one_json_object_and_a_picture(short, capsys):
    assert main(["evaluate", "cape", "-m", short, "--json", "--picture", "worst.png"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["model"] == "cape" and figures["inside_percent"]["after"] == 0
    from PIL import Image

    with Image.open("worst.png") as picture:
        assert picture.size[0] > 300


def test_a_level_of_detail_is_written_and_measured(short, capsys):
    assert main(["animate", "cape", "-m", short, "-o", "out.npz", "--detail", "0.25"]) == 0
    with np.load("out.npz", allow_pickle=False) as clip:
        assert clip["vertices"].shape == (16, 3172, 3) and clip["faces"].max() == 3171
        assert clip["body_vertices"].shape == (16, 13348, 3)
    capsys.readouterr()
    assert main(["evaluate", "cape", "-m", short, "--json", "--detail", "0.5", "--picture", "worst.png"]) == 0
    figures = json.loads(capsys.readouterr().out)
    assert figures["detail"] == 0.5 and figures["vertices"] == 6345
    assert main(["animate", "cape", "-m", short, "-o", "out.npz", "--detail", "0"]) == 2
    assert "a level of detail is above 0 and at most 1; got detail = 0.0" in capsys.readouterr().err


def test_drape_settles_on_each_shape(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    garments.make_cape(bodies.load("anny24").shaped(), rows=20, columns=40).save("napkin.safetensors")
    asked = ["drape", "napkin.safetensors", "-o", "rests", "--random", "1", "--seed", "4", "--json"]
    assert main(asked) == 0
    drapes = json.loads(capsys.readouterr().out)["shapes"]
    assert [len(drape["betas"]) for drape in drapes] == [0, 16]
    assert all(drape["reason"] is None and drape["figures"]["inside"] == 0 for drape in drapes)
    assert main(asked[:-1]) == 0
    assert "edge_strain_p99" in capsys.readouterr().out and len(list((tmp_path / "rests/takes").iterdir())) == 2


def test_a_garment_made_on_another_shape_is_simulated_from_that_shape(short, capsys):
    body = bodies.load("anny24")
    tall = body.shaped((1.0, 0.5))
    made = garments.make_cape(tall, rows=12, columns=24, name="napkin")
    made.save("napkin.safetensors")
    asked = ["-m", short, "--seconds", "0.1"]
    assert main(["simulate", "napkin.safetensors", *asked, "-o", "data", "--betas", "1", "0.5"]) == 0
    assert np.array_equal(open_dataset("data").garment.vertices, made.vertices), "not by way of the mean body"
    assert main(["drape", "napkin.safetensors", "-o", "rests"]) == 0
    assert np.array_equal(open_dataset("rests").garment.vertices, made.vertices)
    # what is worn together lies on one shape
    garments.coarser_garment(garments.load("trousers-light"), 0.25)[0].save("trousers.safetensors")
    assert main(["simulate", "trousers.safetensors", *asked, "-o", "both", "--over", "napkin.safetensors"]) == 0
    assert open_dataset("both").garment.is_on(body.shaped())


def test_simulated_of_another_material_it_moves_otherwise_and_the_dataset_knows(short, capsys):
    garments.make_cape(bodies.load("anny24").shaped(), rows=12, columns=24, name="napkin").save("napkin.safetensors")
    asked = ["simulate", "napkin.safetensors", "-m", short, "--seconds", "0.2"]
    assert main([*asked, "-o", "own"]) == 0
    assert main([*asked, "-o", "made-of-denim", "--material", "denim"]) == 0
    own, other = open_dataset("own"), open_dataset("made-of-denim")
    assert (own.garment.material.name, other.garment.material.name) == ("cotton", "denim")
    assert other.garment.material == garments.MATERIALS["denim"]
    ends = [data.take(data.clips()[0]).vertices[-1] for data in (own, other)]
    assert np.linalg.norm(ends[0] - ends[1], axis=1).mean() > 1e-4
    capsys.readouterr()
    # a dataset holds takes of one garment of one material; and a name that is none writes nothing
    assert main([*asked, "-o", "own", "--material", "silk"]) == 2
    assert "was made for another garment" in capsys.readouterr().err
    assert main([*asked, "-o", "none", "--material", "tweed"]) == 2
    assert "got 'tweed'" in capsys.readouterr().err and not (open_dataset("own").folder.parent / "none").exists()


@pytest.mark.slow
def test_simulate_fit_animate_evaluate_export(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    napkin = garments.make_cape(bodies.load("anny24").shaped(), rows=20, columns=30, name="napkin")
    garments.write("napkin.safetensors", napkin)
    names = ("walk", "turn", "jump", "kick")
    assert (
        main(
            ["simulate", "napkin.safetensors", "-m", *names, "-o", "data", "--seconds", "1.5", "--jobs", "2", "--json"]
        )
        == 0
    )
    takes = json.loads(capsys.readouterr().out)["takes"]
    assert [take["clip"] for take in takes] == list(names)
    assert not any(take["failed"] for take in takes)
    options = [
        "--components",
        "20",
        "--shape-components",
        "20",
        "--chains",
        "4",
    ]
    assert main(["fit", "data", "--animator", "ropes", "-o", "napkin_model.safetensors", *options]) == 0
    assert main(["animate", "napkin_model.safetensors", "-m", "run", "-o", "run.glb"]) == 0
    monkeypatch.setattr(search, "ROUNDS", 12)
    monkeypatch.setattr(search, "LIMIT_ROUNDS", 4)
    assert main(["character", "napkin_model.safetensors", "-o", "stored.vrm"]) == 0
    assert main(["character", "napkin_model.safetensors", "--takes", "data", "-o", "tuned.vrm"]) == 0
    stored, tuned = (Path(name).read_bytes() for name in ("stored.vrm", "tuned.vrm"))
    assert stored != tuned
    capsys.readouterr()
    assert main(["character", "cape", "--takes", "data", "-o", "other.vrm"]) == 2
    assert "has takes of another garment; got napkin" in capsys.readouterr().err
    assert not Path("other.vrm").exists()
    clip = takes[0]["clip"]
    assert (
        main(["evaluate", "napkin_model.safetensors", "-m", clip, "--truth", "data", "--drive", "truth", "--json"]) == 0
    )
    figures = json.loads(capsys.readouterr().out)
    assert figures["drive"] == "truth" and 0 < figures["vertex_error_mm"]["mean"] < 200
    assert main(["export", "data", "--take", "1", "-o", "take.npz"]) == 0
    with np.load("take.npz") as written:
        assert len(written["vertices"]) == 46  # a second and a half, no lead-in


@pytest.mark.slow
def test_demo_shows_a_cape_a_shirt_on_three_bodies_and_a_dress(tmp_path):
    assert main(["demo", "--out", str(tmp_path)]) == 0
    shapes = {f"tshirt-{name}.glb" for name in ("mean", "tall", "small")}
    written = {path.name for path in tmp_path.iterdir()}
    pictures = {"cape.webp", "tshirt.webp", "dress.webp"}
    assert written == {"cape.glb", "dress.glb", "report.json", "index.html", "play.html"} | pictures | shapes
    named = set(re.findall(r"(?:href|src)='([^']+)'", (tmp_path / "index.html").read_text()))
    assert named == written - {"index.html", "report.json"}
    figures = json.loads((tmp_path / "report.json").read_text())
    assert set(figures) == {"cape", "tshirt mean", "tshirt tall", "tshirt small", "dress"}
    assert all(each["inside_percent"]["after"] == 0 for each in figures.values())
    from PIL import Image

    with Image.open(tmp_path / "tshirt.webp") as moving:
        assert moving.n_frames == 60 and moving.size == (960, 480)
