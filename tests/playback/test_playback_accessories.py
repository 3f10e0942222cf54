"""Accessories of a body keep cloth out, of fitted models and of `live`; judged by winding numbers of libigl."""

import warnings

import igl
import numpy as np
import pytest
import trimesh

import hemline
from hemline import bodies
from hemline.errors import HemlineWarning
from hemline.motions import JOINT_NAMES
from hemline.tryon import open_garment

DT = 1 / 30


@pytest.fixture(scope="module")
def run():
    return hemline.motions.load("run")[10:22]


def carrying(folder, joint, offset, extents):
    """The shipped body with a box on a joint."""
    body = bodies.load("anny24")
    box = trimesh.creation.box(extents).subdivide().subdivide()
    box.vertices += body.joints[JOINT_NAMES.index(joint)] + offset
    box.export(folder / "box.obj")
    return bodies.attach(body, [bodies.Accessory(folder / "box.obj", joint)])[0].shaped([0.5])


def played(animator, body, clip):
    player = hemline.Player.prepare(animator, body)
    state, frames = player.start(clip[0], pre_roll=0.3, dt=DT), []
    for pose in clip:
        state, frame = player.step(state, pose, DT)
        frames.append(frame)
    return frames


def inside_accessory(frame, body):
    """How many vertices of a garment are inside the accessories."""
    faces = body.body.faces[body.body.faces[:, 0] >= len(body.bare.vertices)]
    skin, cloth = (np.ascontiguousarray(each, np.float64) for each in (frame.body.vertices, frame.vertices))
    return int((igl.winding_number(skin, np.ascontiguousarray(faces, np.int64), cloth) > 0.5).sum())


PLACES = {"cape": [0, 0.1, -0.14], "tshirt-light": [0, 0.1, -0.08]}
"""Where a box on the back is 6 cm deep in the cloth: outside the skin, and half in it, with cloth in between."""


@pytest.mark.parametrize("model", PLACES)
def test_a_fitted_model_plays_on_its_body_with_accessories(tmp_path, run, model):
    animator, body = hemline.load(model), carrying(tmp_path, "spine3", PLACES[model], [0.2, 0.12, 0.12])
    with pytest.warns(HemlineWarning, match=f"'{animator.garment.name}' does not know the accessories"):
        frames = played(animator, body, run)
    without = played(animator, body.bare, run)
    for frame, other in zip(frames, without, strict=True):
        np.testing.assert_array_equal(frame.animated, other.animated)
        assert inside_accessory(frame, body) <= int(frame.report.pinched.sum())
        assert model == "tshirt-light" or not frame.report.pinched.any()
    # the box is where that cloth would be, or nothing was shown
    assert max(inside_accessory(other, body) for other in map(as_carrying(body), without)) > 20


def as_carrying(body):
    """A frame of the body without accessories, with the body that has them in its place."""
    from dataclasses import replace

    return lambda frame: replace(frame, body=replace(frame.body, shaped=body))


def test_live_lays_a_cape_over_a_bag(tmp_path, run):
    body = carrying(tmp_path, "spine3", [0, -0.15, -0.16], [0.3, 0.4, 0.15])
    with warnings.catch_warnings():
        warnings.simplefilter("error", HemlineWarning)
        garment = open_garment("cape-light", body)
        frames = played(hemline.load("live").animator_for(garment, body), body, run)
    for frame in frames:
        assert inside_accessory(frame, body) == 0
    # seen from behind, cloth is in front of all of the bag but its sides
    last = frames[-1]
    to_rest = np.linalg.inv(np.vstack([last.body.transforms[JOINT_NAMES.index("spine3")], [0, 0, 0, 1]]))
    cloth = last.vertices @ to_rest[:3, :3].T + to_rest[:3, 3]
    bag = body.vertices[len(body.bare.vertices) :]
    middle = np.abs(cloth[:, 0]) < 0.1
    within = middle & (cloth[:, 1] > bag[:, 1].min() + 0.05) & (cloth[:, 1] < bag[:, 1].max() - 0.05)
    assert within.sum() > 10 and (cloth[within, 2] < bag[:, 2].min() + 0.01).all()


def test_a_body_with_accessories_keeps_the_name_of_the_body_without_them(tmp_path, monkeypatch):
    """A body file is known to models by its path, as given; its accessories are added to that file by the command."""
    from hemline.cli import main

    monkeypatch.chdir(tmp_path)
    carrying(tmp_path, "spine3", [0, 0.1, -0.14], [0.2, 0.12, 0.12])
    bodies.write("me.safetensors", bodies.load("anny24"))
    assert main(["body", "me.safetensors", "--accessory", "box.obj:spine3", "-o", "armed.safetensors"]) == 0
    assert main(["body", "anny24", "--accessory", "box.obj:spine3", "-o", "hero.safetensors"]) == 0
    assert bodies.load("armed.safetensors").bare.name == "me.safetensors"
    assert bodies.load("hero.safetensors").bare.name == "anny24"
    assert main(["body", "me.safetensors", "-o", "again.safetensors"]) == 0
    assert bodies.read("again.safetensors").name == "anny24", "no path is written into a body without accessories"
