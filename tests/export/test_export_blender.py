"""What we export, played by Blender and compared vertex by vertex. How to get Blender: `blender/README.md`."""

import os
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hemline.export import skin_clip, write

BLENDER = os.environ.get("HEMLINE_BLENDER_PYTHON")
SCRIPT = Path(__file__).parent / "blender" / "read_clip.py"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BLENDER is None, reason="HEMLINE_BLENDER_PYTHON is not set: see tests/export/blender/README.md"),
]


def played(path, clip, tmp_path):
    command = [BLENDER, str(SCRIPT), str(path), str(clip.frame_count), str(int(clip.fps)), str(tmp_path / "read.npz")]
    finished = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert finished.returncode == 0, finished.stderr[-2000:]
    with np.load(tmp_path / "read.npz") as arrays:
        return dict(arrays)


@pytest.mark.parametrize("ending", [".glb", ".usdc"])
def test_scenes_hold_garment_and_body(tmp_path, full_clip, ending):
    (path,) = write(tmp_path / f"clip{ending}", full_clip)
    read = played(path, full_clip, tmp_path)
    for part in full_clip.parts:
        (name,) = [each for each, array in read.items() if array.shape == part.vertices.shape]
        np.testing.assert_allclose(read[name], part.vertices, atol=2e-5)
        assert {frozenset(face) for face in read[f"faces of {name}"].tolist()} == {
            frozenset(face) for face in part.faces.tolist()
        }


@pytest.mark.parametrize(("ending", "quantized"), [(".glb", False), (".glb", True), (".usdc", False)])
def test_skinned_garments_are_within_the_error_that_is_told(tmp_path, full_clip, ending, quantized):
    clip = skin_clip(full_clip, 8)
    (path,) = write(tmp_path / f"clip{ending}", clip, quantized=quantized)
    read = played(path, clip, tmp_path)
    (garment,) = [array for array in read.values() if array.shape == clip.vertices.shape]
    apart = 1000 * np.linalg.norm(garment - clip.vertices, axis=2)
    assert apart.mean() == pytest.approx(clip.skin.mean_error_mm, abs=0.05)
    assert apart.max() == pytest.approx(clip.skin.max_error_mm, abs=0.1)
    (body,) = [array for array in read.values() if array.shape == clip.body_vertices.shape]
    assert 1000 * np.linalg.norm(body - clip.body_vertices, axis=2).max() < 0.1


def test_quantised_morph_targets_are_within_a_tenth_of_a_millimetre(tmp_path, full_clip):
    clip = replace(full_clip, skeleton=None)
    (path,) = write(tmp_path / "clip.glb", clip, quantized=True)
    read = played(path, clip, tmp_path)
    for part in clip.parts:
        (vertices,) = [array for array in read.values() if array.shape == part.vertices.shape]
        assert 1000 * np.linalg.norm(vertices - part.vertices, axis=2).max() < 0.1


@pytest.mark.parametrize("ending", [".pc2", ".mdd"])
def test_point_caches_move_the_meshes_beside_them(tmp_path, full_clip, ending):
    names = write(tmp_path / f"clip{ending}", full_clip)
    for cache, part in zip(names[::2], full_clip.parts, strict=True):
        read = played(cache, full_clip, tmp_path)
        (vertices,) = [array for name, array in read.items() if not name.startswith("faces of")]
        np.testing.assert_allclose(vertices, part.vertices, atol=2e-5)


def test_obj_is_read_as_y_up(tmp_path, full_clip):
    names = write(tmp_path / "clip.obj", full_clip)
    read = played(names[3], full_clip, tmp_path)
    (vertices,) = [array for name, array in read.items() if not name.startswith("faces of")]
    np.testing.assert_allclose(vertices[0], full_clip.vertices[3], atol=2e-5)
