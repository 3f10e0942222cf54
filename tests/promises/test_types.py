"""Shapes and types of all annotations hold while hemline is used as users do, see `typed_scenes`."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.promises.import_graph import files, name_of

SCENES = Path(__file__).parent / "typed_scenes.py"
ROOT = Path(__file__).parents[2]


def shown(scene: str, folder: Path) -> dict[str, int]:
    """Run a scene in a process of its own; how many functions of each module were made ready to be checked."""
    done = subprocess.run(
        [sys.executable, str(SCENES), scene],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.pathsep.join((str(ROOT / "src"), str(ROOT))), "NUMBA_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        timeout=570,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stderr.splitlines()[-1])


def test_a_wrong_shape_and_a_wrong_type_are_seen(tmp_path):
    checked = shown("wrong_shape", tmp_path)
    assert checked["hemline.meshes.normals"] > 0


@pytest.mark.slow
def test_annotations_hold_while_the_cape_plays(tmp_path):
    checked = shown("play", tmp_path)
    loaded = {name.removeprefix("hemline.") for name in checked}
    for file in files():
        name = name_of(file).removesuffix(".py").replace("/", ".")
        if name.startswith(("playback.play", "bodies.posed", "collide.projection.project", "export.clip")):
            assert name in loaded or name.endswith(("kernels", "__init__")), f"{name} was not checked"


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["read", "close_fitting", "simulate", "rest"])
def test_annotations_hold_while_files_are_read_and_cloth_is_simulated(scene, tmp_path):
    assert shown(scene, tmp_path)["hemline.garments.garment"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["fit", "tryon"])
def test_annotations_hold_while_a_model_is_fitted_and_a_garment_tried_on(scene, tmp_path):
    assert shown(scene, tmp_path)["hemline.sim.step.stepper"] > 0
