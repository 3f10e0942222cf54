"""`hemline animate --wind`: what moves, what stays, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import motions
from hemline.animators import Windy, load, shipped_models
from hemline.animators.together import AnimatorTogether
from hemline.cli import main
from hemline.cli.model import open_model

STANDING_S = 0.2
"""Length of the clip, which begins after a second in the wind."""
COARSE = ("--detail", "0.25")
"""Options that play fewer vertices."""
HEM_LOWEST = 0.1
"""Share of a garment's vertices that are its hem."""


@pytest.fixture
def standing(tmp_path, monkeypatch):
    """A clip of a person who stands still, facing +z."""
    monkeypatch.chdir(tmp_path)
    walk = motions.load("walk")
    count = round(walk.fps * STANDING_S)
    rotations, translations = walk.rotations[:1].repeat(count, axis=0), walk.translations[:1].repeat(count, axis=0)
    clip = replace(walk[:count], rotations=rotations, translations=translations)
    motions.write("standing.safetensors", clip)
    return "standing.safetensors"


def played(*words: str) -> np.ndarray:
    """Vertices (frames, verts, 3) of a garment that a command plays [m]."""
    assert main(["animate", *words, "-o", "played.npz", "--no-untangle"]) == 0
    with np.load("played.npz", allow_pickle=False) as clip:
        return clip["vertices"]


def hem(vertices: np.ndarray) -> np.ndarray:
    """Mean place (3,) of the lowest vertices of the first frame, in the last one [m]."""
    height = vertices[0, :, 1]
    return vertices[-1, height <= np.quantile(height, HEM_LOWEST)].mean(axis=0)


def test_wind_of_no_speed_plays_to_the_bits_of_no_wind(standing):
    for words in (["cape", *COARSE], ["tshirt-light", "--seconds", "0.2"]):
        still = played(*words, "-m", standing)
        np.testing.assert_array_equal(still, played(*words, "-m", standing, "--wind", "0", "0", "0"))


@pytest.mark.parametrize(
    "words",
    [["cape", *COARSE], ["skirt", *COARSE], ["--garment", "cape-light"]],
    ids=["cape", "skirt", "live"],
)
def test_wind_moves_the_hem_along_with_it(standing, words):
    calm = hem(played(*words, "-m", standing))
    behind = hem(played(*words, "-m", standing, "--wind", "0", "0", "3")) - calm
    ahead = hem(played(*words, "-m", standing, "--wind", "0", "0", "-3")) - calm
    assert behind[2] > 0.01, "wind from behind moves the hem forwards"
    assert ahead[2] < -0.01 and behind[2] - ahead[2] > 0.05


def test_wind_blows_on_each_of_several_layers():
    layered, _ = open_model("skirt", None, None, (), over=("cape",), wind=(0.0, 0.0, 3.0))
    assert isinstance(layered, AnimatorTogether)
    assert [part.ropes.constants.wind for part in layered.parts] == [(0.0, 0.0, 3.0)] * 2


@pytest.mark.parametrize(
    "words",
    [["tshirt-light"], ["lag", "--garment", "skirt"], ["cape", "--over", "tshirt-light"]],
    ids=["agentdress", "lag", "layer"],
)
def test_a_model_that_takes_no_wind_is_refused_before_anything_is_written(standing, words, capsys, tmp_path):
    before = set(tmp_path.iterdir())
    assert main(["animate", *words, "-m", standing, "-o", "out.npz", "--wind", "0", "0", "3"]) == 2
    said = capsys.readouterr().err
    assert "wind does not move garments of" in said and "got --wind 0 0 3; leave it out" in said
    assert "'ropes' (cape, skirt, knee-dress, robe)" in said and "'live'" in said
    assert set(tmp_path.iterdir()) == before


def test_the_refusal_names_every_shipped_model_that_takes_wind():
    windy = {name for name in shipped_models() if isinstance(load(name), Windy)}
    assert windy == {"cape", "skirt", "knee-dress", "robe", "live"}


def test_wind_is_three_finite_numbers(standing, capsys):
    assert main(["animate", "cape", "-m", standing, "-o", "out.npz", "--wind", "nan", "0", "0"]) == 2
    assert "--wind must be three finite numbers; got --wind nan 0 0; give m/s along x" in capsys.readouterr().err
