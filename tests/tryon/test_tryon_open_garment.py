"""One door to open a garment: as it is, or tried on once, kept in a dataset and found again."""

from dataclasses import replace

import numpy as np
import pytest

from hemline import garments
from hemline.cli import main
from hemline.datasets import open_dataset
from hemline.errors import BadDataset, BadGarment, BadInput, BadOutput, OffBody
from hemline.motions.motion import JOINT_NAMES
from hemline.tryon import open_garment, try_on
from hemline.tryon.open_garment import misfit_reason, sits_on_body


def tube(*, top, bottom, rows=12, around=40):
    """A tube from a radius to another, 0.4 m high, around the origin."""
    turn = 2 * np.pi * np.arange(around) / around
    height, radius = np.linspace(0.1, -0.3, rows)[:, None], np.linspace(top, bottom, rows)[:, None]
    vertices = np.stack([radius * np.sin(turn), height + 0 * turn, radius * np.cos(turn)], axis=-1).reshape(-1, 3)
    index = np.arange(rows * around).reshape(rows, around)
    a, b = index[:-1], np.roll(index[:-1], -1, axis=1)
    c, d = np.roll(index[1:], -1, axis=1), index[1:]
    faces = [np.stack([each.ravel() for each in three], axis=1) for three in ((a, d, c), (a, c, b))]
    return vertices, np.concatenate(faces)


@pytest.fixture
def stranger(as_obj):
    """A skirt in centimetres, nowhere near the body."""
    vertices, faces = tube(top=0.17, bottom=0.28)
    return as_obj("stranger", 100 * (vertices + (3, 5, -2)), faces)


def bits(garment):
    return [each.tobytes() for each in garment.arrays().values()]


def test_a_mesh_that_sits_is_read_as_ever_and_nothing_is_kept(shaped, worn, as_obj, tmp_path):
    path = as_obj("sits", worn["trousers"].vertices, worn["trousers"].faces)
    said = []
    found = open_garment(path, shaped, dressed=False, dataset=tmp_path / "data", say=said.append)
    assert bits(found) == bits(garments.read(path, shaped, dressed=False))
    assert said == [] and not (tmp_path / "data").exists()
    assert bits(open_garment("cape-light", shaped, dataset=tmp_path)) == bits(garments.load("cape-light"))


def test_a_shirt_that_lies_nearer_on_its_side_is_worn_at_the_shoulders(shaped, mesh_of):
    """With z up it would lie flat behind the hips, near the skin and with no bone through it."""
    shirt = open_garment(mesh_of("makehuman_cc0/f_tshirt.obj"), shaped, dressed=False)
    shoulder, hip = (shaped.joints[JOINT_NAMES.index(name)][1] for name in ("left_shoulder", "left_hip"))
    assert shirt.vertices[:, 1].max() > shoulder
    assert shirt.vertices[:, 1].min() > hip - 0.1
    assert np.ptp(shirt.vertices[:, 2]) > 0.2  # in front of the body and behind it


def test_a_stranger_is_tried_on_once(shaped, stranger, tmp_path):
    with pytest.raises(OffBody, match="or have it tried on"):
        garments.read(stranger, shaped)
    said, frames = [], []

    def tried(path):
        return open_garment(
            path, shaped, dataset=tmp_path / "data", say=said.append, progress=lambda done, total: frames.append(done)
        )

    first = tried(stranger)
    assert said[0] == "stranger.obj does not sit on the body: trying it on (as 'hemline tryon' would)"
    assert sits_on_body(first, shaped) and frames
    (kept,) = (tmp_path / "data" / "worn").iterdir()
    assert str(kept) in said[-1] and garments.read(kept).hash == first.hash
    frames.clear()
    # the same mesh by another name; its garment is found again, bit for bit, and not made
    again = tried(stranger.rename(tmp_path / "by_another_name.obj"))
    assert bits(again) == bits(first) and frames == [] and "was tried on before" in said[-1]
    # without a dataset nothing is kept, and the garment is the same
    fresh = open_garment(tmp_path / "by_another_name.obj", shaped, tryon="always", say=said.append)
    assert bits(fresh) == bits(first) and said[-1] == "by_another_name.obj is worn"
    assert bits(try_on(tmp_path / "by_another_name.obj", shaped).garment) == bits(first)


def test_a_dataset_keeps_to_its_garment(shaped, stranger, worn, tmp_path):
    data = tmp_path / "data"
    data.mkdir()
    worn["trousers"].save(data / "garment.safetensors")
    with pytest.raises(BadDataset, match="was made for another garment; got stranger.obj, not tried on for it; choose"):
        open_garment(stranger, shaped, dataset=data)
    (tmp_path / "file").write_text("")
    with pytest.raises(BadOutput, match="file, which is a file"):
        open_garment(stranger, shaped, dataset=tmp_path / "file" / "data")


def test_as_it_is_a_mesh_is_read_or_refused(shaped, stranger, worn, as_obj):
    path = as_obj("sits", worn["trousers"].vertices, worn["trousers"].faces)
    silk = open_garment(path, shaped, tryon="never", material="silk")
    assert bits(silk) == bits(garments.read(path, shaped)) and silk.material.name == "silk"
    with pytest.raises(OffBody, match="or have it tried on"):
        open_garment(stranger, shaped, tryon="never")
    with pytest.raises(BadGarment, match="unknown material; got 'sulk'"):
        open_garment(stranger, shaped, material="sulk")
    with pytest.raises(BadGarment, match="unknown garment; got 'cap'; did you mean 'cape'"):
        open_garment("cap", shaped)
    with pytest.raises(BadInput, match="tryon must be one of auto, never, always; got 'loose'"):
        open_garment("cape-light", shaped, tryon="loose")


def test_cloth_that_a_bone_goes_through_does_not_sit(shaped, worn):
    shirt = worn["tshirt"]
    assert sits_on_body(shirt, shaped)
    assert not sits_on_body(replace(shirt, vertices=shirt.vertices + np.float32([0, 0.1, 0])), shaped)
    taller = shaped.body.shaped((0.5,))
    assert sits_on_body(shirt, taller), "it is on the shape that it was made on"


def test_panels_that_lie_apart_do_not_sit(shaped):
    skirt = garments.load("skirt:0@35", shaped)
    assert sits_on_body(skirt, shaped)
    front = skirt.vertices[:, 2:] > np.median(skirt.vertices[:, 2])
    apart = replace(skirt, vertices=(skirt.vertices + np.where(front, [0, 0, 0.3], 0)).astype(np.float32))
    assert misfit_reason(apart, shaped) == "its panels are not sewn together yet"


def test_what_cannot_be_worn_says_so_and_keeps_nothing(shaped, as_obj, tmp_path):
    vertices, faces = tube(top=0.05, bottom=0.05)
    path = as_obj("tiny", vertices + (3, 5, -2), faces)
    with pytest.raises(BadGarment, match="tiny.obj does not sit on the body and cannot be worn as it is; got .*; see"):
        open_garment(path, shaped, dataset=tmp_path / "data")
    assert not (tmp_path / "data").exists()


def test_a_command_goes_on_with_what_it_tried_on(stranger, as_obj, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    asked = ["simulate", str(stranger), "-m", "run", "--seconds", "0.1", "-o", "data"]
    assert main([*asked, "--no-tryon"]) == 2
    assert "tried on" in capsys.readouterr().err and not (tmp_path / "data").exists()
    assert main(asked) == 0
    assert "trying it on" in capsys.readouterr().err

    def content():
        return {path: path.read_bytes() for path in sorted((tmp_path / "data").rglob("*.safetensors"))}

    before = content()
    assert main(asked) == 0
    assert "trying it on" not in capsys.readouterr().err
    assert main(["drape", str(stranger), "-o", "data"]) == 0
    assert content() == before and len(open_dataset("data").rows()) == 2
    vertices, faces = tube(top=0.18, bottom=0.28)
    assert main(["simulate", str(as_obj("other", vertices + (3, 5, -2), faces)), *asked[2:]]) == 2
    assert "was made for another garment" in capsys.readouterr().err and content() == before
