"""The extension, built, installed and used in Blender itself. How to get one: `tests/export/blender/README.md`."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

import hemline
from hemline import garments, motions
from hemline.animators import load, model_path
from hemline.cli import main
from hemline.collide import inside
from hemline.meshes import closest_points_on_mesh
from hemline.playback import play

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "integrations" / "blender"
BLENDER = os.environ.get("HEMLINE_BLENDER_PYTHON")
in_blender = [
    pytest.mark.slow,
    pytest.mark.skipif(BLENDER is None, reason="HEMLINE_BLENDER_PYTHON is not set: see tests/export/blender/README.md"),
]
SHORT = {"start": 0.0, "seconds": 0.4}


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """The extension as `make blender-extension` builds it, and what Blender's own command says of it."""
    folder = tmp_path_factory.mktemp("package")
    command = [BLENDER, str(SOURCE / "build.py"), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / f"hemline-{hemline.__version__}.zip", done.stdout


@pytest.fixture
def scene(tmp_path, package):
    """Plays a scene of `extension_scenes.py` in Blender: what it tells, and its vertices by name."""
    program = tmp_path / "bin" / "hemline"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m hemline "$@"\n')
    program.chmod(0o755)

    def played(name):
        script = Path(__file__).parent / "extension_scenes.py"
        command = [BLENDER, str(script), name, str(tmp_path), str(package[0]), str(program)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
        assert done.returncode == 0, done.stdout[-1000:] + done.stderr[-3000:]
        with np.load(tmp_path / "vertices.npz") as arrays:
            return json.loads((tmp_path / "told.json").read_text()), dict(arrays)

    return played


def frames(model="cape", *, betas=(), fps=30.0, detail=0.1, seconds=0.4, wind=(0.0, 0.0, 0.0)):
    """Garment and body, played in this process."""
    animator, body = load(model).in_wind(wind), hemline.bodies.load("anny24").shaped(betas)
    motion = motions.load("run")
    motion = motion[: round(seconds * motion.fps) + 1]
    return list(play(animator, body, motion, fps=fps, detail=detail, untangle=True))


def apart_mm(one, other):
    return 1000 * np.linalg.norm(np.asarray(one) - np.asarray(other), axis=-1).max()


class TestInBlender:
    pytestmark = in_blender

    def test_blender_builds_a_valid_package_with_the_licence(self, package):
        path, said = package
        assert "Success parsing TOML" in said
        with zipfile.ZipFile(path) as archive:
            packed = {name: archive.read(name) for name in archive.namelist()}
        expected = {each.name: each.read_bytes() for each in (SOURCE / "hemline").iterdir() if each.is_file()}
        assert packed == {**expected, "LICENSE": (ROOT / "LICENSE").read_bytes()}

    def test_garment_and_body_stand_where_hemline_puts_them(self, scene):
        told, read = scene("plays")
        played = frames(betas=(0.5, -1.0), detail=1.0)
        assert len(played) == 13 and told["range"] == [11, 23]
        garment = np.array([frame.vertices for frame in played])
        body = np.array([frame.body.vertices for frame in played])
        assert apart_mm(read["garment"], garment) < 0.1
        assert apart_mm(read["body"], body) < 0.1
        assert apart_mm(read["garment too early"], garment[:1]) < 0.1
        assert apart_mm(read["garment too late"], garment[-1:]) < 0.1
        np.testing.assert_array_equal(read["garment faces"], load("cape").garment.faces)
        assert apart_mm(read["garment later"], garment) < 0.1
        x, y, z = garment[0].T  # a quarter turn about the vertical axis, and two metres along x
        assert apart_mm(read["garment moved"][0], np.stack([z + 2, y, -x], axis=1)) < 0.1
        assert "CC0-1.0" in told["notices"] and "mocap.cs.cmu.edu" in told["notices"]

    def test_times_are_those_of_the_clip_at_any_rate(self, scene):
        told, read = scene("rates")
        fine = np.array([frame.vertices for frame in frames(fps=60.0)])
        times = np.arange(9) / 24 * 60
        low, share = times.astype(int), (times % 1)[:, None, None]
        between = (1 - share) * fine[low] + share * fine[np.minimum(low + 1, len(fine) - 1)]
        assert apart_mm(read["garment"], between) < 0.1
        assert told == {"parts": ["garment"], "outdated": True, "again": False}
        film = np.array([frame.vertices for frame in frames(fps=24 / float(np.float32(1.001)))])
        assert apart_mm(read["film"][: len(film)], film[:9]) < 0.1

    def test_wind_blows_along_the_axes_of_blender(self, scene, tmp_path):
        shutil.copy(model_path("tshirt-light"), tmp_path / "shirt.safetensors")
        told, read = scene("blows")
        windy = frames(wind=(0.5, 0.25, 4.0))
        assert apart_mm(read["garment"], [frame.vertices for frame in windy]) < 0.1
        assert "--wind" not in told["calm"] + told["shirt"]
        assert told["refused"].startswith("hemline: wind does not move garments of agentdress; got --wind 0 0 4;")

    def test_what_was_done_to_an_object_stays_when_it_is_played_again(self, scene):
        told, _ = scene("keeps")
        assert re.match(r"hemline: no motion of that name ships; got 'nothing'; the nearest name is", told["failed"])
        assert told["bake refused"] == "the settings are others than those that were played; press Play first"
        assert told["materials"] == told["still"] == ["mine"] and told["modifiers"] == ["hemline", "mine"]
        assert told["smoothed"] and told["moved"] > 0.1
        assert told["finer"] > 2000

    def test_a_baked_cache_moves_with_the_file(self, scene):
        told, read = scene("bakes_a_cache")
        assert re.match("point caches lie beside the .blend; got one that was never saved; save it", told["unsaved"])
        assert re.match("cannot write into .*/project/hemline; got hemline: File exists; make room", told["locked"])
        assert re.match("cannot write into .*; got hemline_body.pc2: Is a directory; make room", told["half locked"])
        assert told["files"] == ["hemline/hemline.pc2", "hemline/hemline_body.pc2"]
        assert all(path.startswith("//hemline/hemline") for path in told["paths"])
        np.testing.assert_array_equal(read["garment"], read["opened"])

    def test_playing_again_removes_what_play_wrote_and_no_folder_that_a_file_names(self, scene):
        told, _ = scene("removes_its_own")
        assert told == {"mine": ["garment.pc2", "garment_body.pc2", "sketches.txt"], "first": True, "second": False}

    def test_baked_keys_need_neither_extension_nor_files(self, scene):
        told, read = scene("bakes_keys")
        for name in ("baked", "opened", "again"):
            assert apart_mm(read[name], read["garment"]) < 0.1
        assert told["baked again"] == "nothing to bake; got no point cache; press Play first" and not told["keys"]

    def test_a_mesh_of_the_scene_is_worn(self, scene, tmp_path):
        shirt = garments.load("tshirt-light")
        np.savez(tmp_path / "own.npz", vertices=shirt.vertices, faces=shirt.faces)
        told, read = scene("wears_a_mesh")
        lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in shirt.vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (shirt.faces + 1).tolist()]
        (tmp_path / "own.obj").write_text("\n".join(lines) + "\n")
        words = ["--garment", str(tmp_path / "own.obj"), "-m", "run", "--seconds", "0.2"]
        assert main(["animate", "live", *words, "-o", str(tmp_path / "own_played.npz")]) == 0
        with np.load(tmp_path / "own_played.npz") as played:
            vertices = played["vertices"]  # `live` keeps to a budget of time: two runs differ by millimetres
        assert np.linalg.norm(read["garment"] / 100 - vertices, axis=-1).mean() < 0.01  # the scene counts centimetres
        assert told["none"].startswith("hemline: model 'live' needs a garment to wear")

    def test_what_cannot_be_done_is_said_in_the_words_of_hemline(self, scene, tmp_path):
        (tmp_path / "script").write_text("no program")
        told, _ = scene("refuses")
        expected = {
            "model": "hemline: no shipped model has this name; got 'cap'; did you mean 'cape'",
            "file": "hemline: cannot read .*no.safetensors; got No such file or directory; name a model file",
            "damaged": "hemline: .* is no hemline model file",
            "motion": "hemline: cannot read .*no.bvh; got No such file or directory; name a BVH file",
            "betas": "hemline: no body of that name ships; got 'smpl'",
            "garment": "hemline: model 'live' needs a garment to wear; got none",
            "material": "hemline: .* plays garments of the material that it learned; got --material silk",
            "no program": "hemline was not found; got '/no/such/hemline' is no program; name it in Preferences",
            "another program": "the program is not hemline; got .*/true, which said ''; name another one",
            "not run": "hemline was not found; got '.*script' is no program",
            "not on the path": "hemline was not found; got none on the PATH; name it in Preferences",
        }
        assert told.keys() == expected.keys()
        for name, text in expected.items():
            assert re.match(text, told[name]), told[name]
            assert "\n" not in told[name]

    def test_blender_goes_on_while_hemline_works(self, scene):
        told, _ = scene("plays_in_the_background")
        shares = [share for stage, share, _ in told["stages"] if stage == "animate"]
        assert shares == sorted(shares) and shares[-1] > 0.5
        left = [seconds for _, share, seconds in told["stages"] if seconds is not None and share > 0]
        assert left and min(left) >= 0 and left[-1] < 60
        assert told["busy"] == "hemline is at work on another object; wait for it, or stop it"
        assert told["stopped"] == "stopped; nothing was changed"
        assert told["frames"] == 7
        assert told["live"].startswith("hemline: no motion of that name") and told["tried again"] is None

    def test_a_mesh_is_tried_on_and_its_pins_stay_on_the_skin(self, scene, tmp_path):
        shirt = garments.load("tshirt-light")
        height = shirt.vertices[:, 1]
        held = np.flatnonzero(height > height.max() - 0.03)
        loose = np.flatnonzero(height < height.min() + 0.03)
        own = shirt.vertices + np.array([0.0, 0.02, 0.0], np.float32)
        np.savez(tmp_path / "own.npz", vertices=own, faces=shirt.faces, held=held, loose=loose)
        told, read = scene("tries_on")
        assert "worn: edge_strain" in told["message"] and told["pins"] == held.tolist()
        assert told["kept"] == ["mine", "pattern", [480, 640]] and told["betas"][:2] == [0.5, 0.0]
        faces = hemline.bodies.load("anny24").faces
        skin = hemline.bodies.load("anny24").shaped((0.5,)).vertices
        assert not inside(skin, faces, read["worn"][0]).any()
        frames = zip(read["garment"], read["body"], strict=True)
        above_mm = [1000 * closest_points_on_mesh(worn, skin, faces).distances for worn, skin in frames]
        moves_mm = np.ptp(above_mm, axis=0)
        assert moves_mm[held].max() < 5 < moves_mm[loose].max()
        assert told["no group"] == "the pins must be a vertex group of 'own'; got 'sleeves', it has held; choose one"
        assert told["no vertices"].startswith("the pins must have vertices; got none above 0.5 in 'sleeves'")
        assert told["stopped"] == "stopped; nothing was changed"
        assert told["cube"].startswith("hemline: ")

    def test_alembic_has_what_was_played(self, scene):
        _, read = scene("exports_alembic")
        played = frames()
        assert apart_mm(read["garment"], [frame.vertices for frame in played]) < 0.1
        assert apart_mm(read["body"], [frame.body.vertices for frame in played]) < 0.1

    def test_the_script_of_the_page_makes_two_seconds_of_shape_keys(self, scene):
        told, _ = scene("runs_the_script")
        assert told == {
            "message": "49 frames in shape keys; Play again turns them back into a point cache",
            "keys": 49,
            "range": [1, 49],
        }

    def test_the_panel_shows_what_fits_the_active_object(self, scene):
        told, _ = scene("is_drawn")
        assert told["nothing"] == ["hemline garment"]
        assert told["mesh"] == ["Pins", "Body", "Betas", "Try On", "Add to Play It"]
        assert "Wind" in told["object"] and "Wind" not in told["shirt"] and "Motion" in told["shirt"]
        assert {"Model", "Motion", "Material", "Untangle", "Play", "Bake Cache"} <= set(told["object"])
        assert not {"Garment", "Pins", "Try On"} & set(told["object"]) and {"Garment", "Pins"} <= set(told["garment"])
        assert any(re.fullmatch(r"animate \d+ %, \d+ s left", text) for text in told["at work"])
        assert "Settings were changed: press Play" in told["changed"]

    def test_a_picture_shows_a_red_cape(self, scene):
        _, read = scene("is_rendered")
        red, green, blue = read["picture"][..., :3].reshape(-1, 3).T
        assert 0.02 < ((red > 1.8 * green) & (red > 1.8 * blue)).mean() < 0.3


def test_progress_is_told_in_lines_to_other_programs(tmp_path, monkeypatch, capsys):
    words = ["animate", "cape", "-m", "run", "--seconds", "0.2", "--detail", "0.1", "-o", str(tmp_path / "run.npz")]
    monkeypatch.setenv("HEMLINE_PROGRESS", "lines")
    assert main(words) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if line.startswith("progress")]
    assert told == [f"progress: animate {done}/7" for done in range(1, 8)]
    monkeypatch.delenv("HEMLINE_PROGRESS")
    assert main(words) == 0
    assert "progress:" not in capsys.readouterr().err


def test_lines_of_progress_come_once_a_percent(monkeypatch, capsys):
    from hemline.cli.progress import bars, stages

    monkeypatch.setenv("HEMLINE_PROGRESS", "lines")
    with stages() as report:
        for done in range(1001):
            report("fit", done, 1000)
    assert len(capsys.readouterr().err.splitlines()) == 101
    with bars() as display:
        task = display.add_task("try on", total=None)
        display.update(task, completed=1)
        display.update(task, completed=1, total=2, visible=True)
    assert capsys.readouterr().err == "progress: try on 1/2\n"
