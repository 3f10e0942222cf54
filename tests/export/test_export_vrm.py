"""VRM as engines read it: three-vrm in Chromium, and Khronos' validator; the shipped models."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest

import hemline
from hemline.cli import main
from hemline.errors import BadInput, BadOutput
from hemline.export import check_format, write_vrm
from hemline.export.vrm.vrm_humanoid import VRM_BONES
from hemline.motions.motion import JOINT_NAMES, Pose
from hemline.motions.rigs.bone_names import VRM
from hemline.playback import character
from tests.export.web import three, validated

STILL, WAY, AFTER = 90, 45, 240
"""Frames at 60 a second before, during and after the way."""


@pytest.fixture(scope="module")
def body():
    return hemline.bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def person(body):
    return character(hemline.load("cape"), body)


@pytest.fixture(scope="module")
def path(person, tmp_path_factory):
    return write_vrm(tmp_path_factory.mktemp("vrm") / "cape.vrm", person)[0]


def extensions(path):
    content = path.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    return json.loads(content[20 : 20 + length])["extensions"]


def worn(mesh, person):
    """Where a mesh is at rest, by its weights and binds in float64."""
    places = np.concatenate([person.joints, person.chains.bones])[: len(mesh.binds)]
    at = mesh.binds.copy()
    at[..., 3] += places
    blended = np.einsum("vi,virc->vrc", mesh.weights, at[mesh.bones])
    return np.einsum("vrc,vc->vr", blended[..., :3], mesh.vertices) + blended[..., 3]


def test_the_validator_finds_no_errors(path):
    (said,) = validated(path)
    assert (said["numErrors"], said["numWarnings"]) == (0, 0)
    assert {message["code"] for message in said["messages"]} == {"UNSUPPORTED_EXTENSION"}


def test_three_vrm_swings_the_cape_and_brings_it_to_rest(path, person, body):
    ahead = (0.5 - 0.5 * np.cos(np.linspace(0, np.pi, WAY))).tolist()
    way = [[0, 0, 0]] * STILL + [[0, 0, z] for z in ahead] + [[0, 0, 1]] * AFTER
    kept = [STILL - 1, STILL + WAY - 12, STILL + WAY + AFTER - 1]
    with three(path.parent) as page:
        found = page("window.swingVrm", f"/{path.name}", way, kept, {})
        lowered = page("window.swingVrm", f"/{path.name}", [], [], {"leftUpperArm": [0, 0, -0.5, 0.75**0.5]})
    cape, skin = found["cape"], found["body"]
    assert np.abs(cape[0] - worn(person.meshes[0], person)).max() < 1e-4
    assert np.abs(skin[0] - worn(person.meshes[1], person)).max() < 1e-4
    assert found["springs"][0, 0, :2].tolist() == [26 * 8, 26]
    bones = {name.removeprefix("bone "): place[0, 0] for name, place in found.items() if name.startswith("bone ")}
    assert len(bones) == 22
    assert np.allclose(bones["leftLowerArm"], person.joints[JOINT_NAMES.index("left_elbow")], atol=1e-5)
    # the hem stays behind on the way, then hangs as before
    hem = cape[0, :, 1] < np.quantile(cape[0, :, 1], 0.1)
    settled = np.linalg.norm(cape[1] - cape[0], axis=1)
    assert settled.mean() < 0.01
    behind = cape[2, hem, 2] - cape[1, hem, 2] - ahead[WAY - 12]
    assert behind.mean() < -0.1
    assert np.linalg.norm(cape[3] - [0, 0, 1] - cape[1], axis=1).mean() < 0.01
    # a turned joint moves the skin as it moves ours, but for the weights beyond four
    pose = np.zeros((24, 4), np.float32)
    pose[:, 0] = 1
    pose[JOINT_NAMES.index("left_shoulder")] = [0.75**0.5, 0, 0, -0.5]
    ours = body.posed(Pose(pose, person.joints[0])).vertices
    away = np.linalg.norm(lowered["body"][0] - ours, axis=1)
    assert away.mean() < 1e-4 and away.max() < 0.006


def test_the_body_and_the_cape_are_where_the_player_puts_them(person, body):
    rest = worn(person.meshes[1], person)
    still = np.zeros((24, 4), np.float32)
    still[:, 0] = 1
    assert np.abs(rest - body.posed(Pose(still, person.joints[0])).vertices).max() < 1e-5
    assert abs(rest[:, 1].min()) < 1e-5
    cape = worn(person.meshes[0], person)
    nodes = hemline.load("cape").ropes.positions_on(cape)
    assert np.abs(nodes[-len(person.chains.bones) :] - person.chains.bones).max() < 1e-5


def test_weights_are_four_and_share_all_of_a_vertex(person):
    for mesh in person.meshes:
        assert mesh.weights.shape[1] == 4 and mesh.weights.min() >= 0
        assert np.allclose(mesh.weights.sum(axis=1), 1)
        assert mesh.bones.max() < len(mesh.binds)


def test_no_bone_begins_inside_a_collider(person):
    capsules, chains = person.capsules, person.chains
    free = np.concatenate([bones[1:] for bones in chains.spans])
    for start, end, radius in zip(capsules.starts, capsules.ends, capsules.radii, strict=True):
        way = end - start
        share = np.clip((chains.bones[free] - start) @ way / (way @ way), 0, 1)
        away = np.linalg.norm(chains.bones[free] - start - share[:, None] * way, axis=1)
        assert (away >= radius + chains.radii[free] - 1e-9).all()


def test_a_falling_bone_falls_as_the_ropes_do(path):
    """Without drag, a frame adds what gravity adds in 1/60 s: stiffness and gravity of the lowest bones together."""
    springs = extensions(path)["VRMC_springBone"]["springs"]
    lowest = [spring["joints"][-2] for spring in springs]
    pulls = [joint["stiffness"] + joint["gravityPower"] for joint in lowest]
    assert 60 * min(pulls) == pytest.approx(9.81, rel=0.25)
    assert all(0 < joint["dragForce"] < 1 for spring in springs for joint in spring["joints"][:-1])


def test_what_is_allowed_follows_the_licence_of_the_body(person, tmp_path):
    asked = write_vrm(tmp_path / "own.vrm", replace(person, notices=("for research alone",)))[0]
    free = extensions(write_vrm(tmp_path / "free.vrm", person)[0])["VRMC_vrm"]["meta"]
    own = extensions(asked)["VRMC_vrm"]["meta"]
    assert {"name", "authors", "licenseUrl"} <= set(free) and free["licenseUrl"] == "https://vrm.dev/licenses/1.0/"
    assert (free["avatarPermission"], own["avatarPermission"]) == ("everyone", "onlyAuthor")
    assert own["modification"] == "prohibited" and own["thirdPartyLicenses"] == "for research alone"


def test_a_model_without_chains_is_refused(body):
    with pytest.raises(BadInput, match="are made of rope chains; got a model of kind 'agentdress'"):
        character(hemline.load("tshirt-light"), body)


def test_a_clip_is_no_character_and_a_character_no_clip(person, tmp_path):
    with pytest.raises(BadOutput, match="no motion; got out.vrm; write one with 'hemline character MODEL -o out.vrm'"):
        check_format(tmp_path / "out.vrm")
    with pytest.raises(BadOutput, match="written as .vrm; got out.glb; name it out.vrm"):
        write_vrm(tmp_path / "out.glb", person)
    assert not list(tmp_path.iterdir())


def test_the_command_says_what_it_wrote(tmp_path, capsys):
    assert main(["character", "skirt", "-o", str(tmp_path / "skirt.vrm"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["chains"], said["bones"], said["colliders"]) == (36, 360, 26)
    assert said["bytes"] == (tmp_path / "skirt.vrm").stat().st_size < 3e6


@pytest.mark.parametrize("model", ["live", "tshirt-light"])
def test_the_command_refuses_a_model_without_chains(model, tmp_path, capsys):
    assert main(["character", model, "-o", str(tmp_path / "out.vrm")]) == 2
    err = capsys.readouterr().err
    assert err.startswith("hemline: spring bones are made of rope chains") and err.count("\n") == 1
    assert "a model of kind" in err
    assert not (tmp_path / "out.vrm").exists()


def test_characters_are_read_by_the_names_that_ours_are_written_with():
    assert VRM.items() <= VRM_BONES.items(), "export knows nothing of motions, so the names stand in both"
