"""Ropes get the air of the takes, and a fit says so if the takes do not name it or do not agree."""

import warnings
from types import SimpleNamespace

import numpy as np
import pytest

from hemline import bodies, garments
from hemline.animators.ropes.fit.air import air_density_of
from hemline.animators.ropes.mechanics.constants import AIR_DENSITY
from hemline.datasets import Take, create
from hemline.errors import HemlineWarning
from hemline.motions.motion import Motion


def source_of(folder, *settings, frames=None, validation=()):
    """Takes with these settings of the simulator, of one frame each or as many as said."""
    cape, body = garments.load("cape-light"), bodies.load("anny24").shaped()
    data, pose = create(folder / "data", cape), body.rest_pose
    for part, each in enumerate(settings):
        count = frames[part] if frames else 1
        still = np.repeat(pose.rotations[None], count, axis=0), np.repeat(pose.translation[None], count, axis=0)
        inputs = {"garment": cape.hash, "clip": "still", "part": part, "simulator": 1} | each
        data.add(
            Take(
                "clip",
                np.repeat(cape.vertices[None], count, axis=0),
                Motion(*still, 30.0, body.leg_length, name="still"),
                np.zeros(16, np.float32),
                lead_in=np.zeros(count, bool),
                pinched=np.zeros(count, np.int32),
                figures={},
                inputs=inputs,
            )
        )
    sides = tuple(1 if part in validation else 0 for part in range(len(settings)))
    return SimpleNamespace(dataset=data, rows=data.rows(), sides=sides)


@pytest.mark.parametrize("density", [0.6, 0, 1.2])
def test_the_density_of_the_air_is_that_of_the_takes(tmp_path, density):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert air_density_of(source_of(tmp_path, {"settings": {"air_density": density}})) == density


@pytest.mark.parametrize(
    "inputs", [{"settings": {"air_density": "thick"}}, {"settings": {"air_density": -1.0}}, {"settings": 5}, {}]
)
def test_air_that_no_take_names_is_assumed_aloud(tmp_path, inputs):
    with pytest.warns(HemlineWarning, match="do not say in which air they were simulated; got 1 such takes"):
        assert air_density_of(source_of(tmp_path, inputs)) == AIR_DENSITY


def test_of_several_densities_that_of_most_frames_is_taken_aloud(tmp_path):
    thin, thick = ({"settings": {"air_density": density}} for density in (0.8, 1.5))
    source = source_of(tmp_path, thick, thin, thin, thick, frames=(2, 2, 3, 9), validation=(3,))
    with pytest.warns(HemlineWarning, match=r"got 5 frames at 0.8 kg/m\^3, 2 frames at 1.5 kg/m\^3"):
        assert air_density_of(source) == 0.8
