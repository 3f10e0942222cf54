"""Clips in FBX text that the tests write themselves, read by way of ufbx in a process of its own."""

import numpy as np
import pytest

from hemline import motions
from hemline.errors import BadMotion, MissingExtra
from hemline.files import fbx
from hemline.files.gltf import read_gltf
from hemline.motions import JOINT_NAMES
from hemline.motions.quaternions import angle, inverse, multiply, rotate
from tests.motions.bvh_samples import NAMES, OURS, person
from tests.motions.fbx_samples import fbx_of

pytest.importorskip("ufbx")


def test_a_clip_is_that_of_its_bones(tmp_path):
    clip = person(frames=9)
    (tmp_path / "clip.fbx").write_text(fbx_of(clip))
    motion = motions.read(tmp_path / "clip.fbx")
    assert (len(motion), motion.fps, motion.name) == (9, 30, "take")
    for joint, name in enumerate(JOINT_NAMES):
        if name in OURS:
            theirs = clip.rotations[:, NAMES.index(OURS[name])]
            off = np.degrees(angle(multiply(inverse(theirs), motion.rotations[:, joint].astype(float))))
            assert off.max() < 0.1, name
    middle = clip.positions[0] + rotate(clip.rotations[:, 0], np.array([0.0, -8, 1]))
    assert np.allclose(motion.translations, 0.01 * middle, atol=1e-4)


def test_one_of_several_animations_is_named(tmp_path):
    (tmp_path / "clip.fbx").write_text(fbx_of(person(frames=3), ("walk", "run")))
    with pytest.raises(BadMotion, match="has 2 animations; got walk, run; name one: .*clip.fbx:walk"):
        motions.read(tmp_path / "clip.fbx")
    assert motions.read(f"{tmp_path}/clip.fbx:run").name == "run"


def test_meshes_come_with_their_skin(tmp_path):
    (tmp_path / "clip.fbx").write_text(fbx_of(person(frames=2)))
    gltf = read_gltf(tmp_path / "clip.fbx", error=BadMotion)
    (mesh,), (skin,) = gltf.all("meshes"), gltf.all("skins")
    primitive = mesh["primitives"][0]
    assert np.allclose(gltf.array(primitive["attributes"]["POSITION"])[:, :2], [[0, 0], [10, 0], [10, 10], [0, 10]])
    assert gltf.array(primitive["indices"]).tolist() == [0, 1, 2, 0, 2, 3]
    assert [gltf.all("nodes")[joint]["name"] for joint in skin["joints"]] == ["Hips"]
    assert np.allclose(gltf.array(primitive["attributes"]["WEIGHTS_0"]), [[1, 0, 0, 0]] * 4)


@pytest.mark.parametrize("content", [b"", b"no FBX at all", b"Kaydara FBX Binary  \x00\x1a\x00" + b"\xff" * 60])
def test_what_is_no_fbx_is_refused_with_the_way_round(tmp_path, content):
    (tmp_path / "clip.fbx").write_bytes(content)
    with pytest.raises(BadMotion, match="cannot be read as FBX; got .*; import it in Blender, and export it as .glb"):
        motions.read(tmp_path / "clip.fbx")


def test_the_library_is_asked_for_where_it_is_missing(tmp_path, monkeypatch):
    (tmp_path / "clip.fbx").write_text(fbx_of(person(frames=2)))
    monkeypatch.setattr(fbx, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"reading .*clip.fbx needs ufbx; .*pip install 'hemline\[fbx\]'"):
        motions.read(tmp_path / "clip.fbx")
