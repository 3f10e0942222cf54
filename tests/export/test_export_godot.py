"""What we export, imported and played by Godot 3 without a screen (Debian: `godot3-server`), vertex by vertex."""

import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline.export import skin_clip, write

GODOT = shutil.which("godot3-server")
SCRIPTS = Path(__file__).parent / "godot"
PROJECT = """config_version=4

[importer_defaults]

scene={{
"animation/fps": {fps},
"animation/optimizer/enabled": false
}}
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(GODOT is None, reason="Godot is not installed (Debian: apt install godot3-server)"),
]


@pytest.fixture
def project(tmp_path, full_clip):
    """A project of Godot, which takes its import's frames a second from the clip and keeps every key."""
    (tmp_path / "project.godot").write_text(PROJECT.format(fps=full_clip.fps))
    return tmp_path


def godot(project, *words):
    command = [GODOT, "--path", str(project), *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


def played(project, script, *words):
    """What a script writes after all files of the project were imported."""
    godot(project, "--export-pack", "none", "none.pck")  # imports, then says that there is no such preset
    out = project / "played.json"
    done = godot(project, "--script", SCRIPTS / script, *words, out)
    assert out.exists(), done.stdout + done.stderr
    return json.loads(out.read_text())


def apart_mm(found, wanted):
    return 1000 * np.linalg.norm(np.array(found) - wanted, axis=2)


def test_morph_targets_are_within_a_tenth_of_a_millimetre(project, full_clip):
    (path,) = write(project / "clip.glb", replace(full_clip, skeleton=None))
    read = played(project, "play_clip.gd", path.name, full_clip.frame_count, full_clip.fps)
    assert apart_mm(read["red cape"], full_clip.vertices).max() < 0.1
    assert apart_mm(read["body"], full_clip.body_vertices).max() < 0.1


def test_a_skinned_garment_is_within_the_error_that_is_told(project, full_clip):
    clip = skin_clip(full_clip, 8)
    (path,) = write(project / "clip.glb", clip)
    read = played(project, "play_clip.gd", path.name, clip.frame_count, clip.fps)
    apart = apart_mm(read["red cape"], clip.vertices)
    assert apart.mean() == pytest.approx(clip.skin.mean_error_mm, abs=0.02)
    assert apart.max() == pytest.approx(clip.skin.max_error_mm, abs=0.05)


def test_textures_are_within_a_tenth_of_a_millimetre(project, far_clip):
    write(project / "clip.vat", far_clip)
    read = played(project, "play_textures.gd", "clip")
    assert apart_mm(read, far_clip.vertices).max() < 0.1
