"""VRM as engines read it: three-vrm in Chromium, and Khronos' validator; the shipped models."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

import hemline
from hemline.animators.ropes.springs import skeleton_of, t_pose
from hemline.cli import main
from hemline.errors import BadInput, BadOutput
from hemline.export import check_format, write_spring_table, write_vrm
from hemline.export.vrm.vrm_humanoid import VRM_BONES
from hemline.meshes import ClosestTree, boundary_loops
from hemline.motions.motion import JOINT_NAMES, PARENTS, Pose
from hemline.motions.rigs.bone_names import VRM
from hemline.playback import character
from hemline.playback.draw_in import DEPTH, FADE
from hemline.springs import distances_to_axes, swing
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


def bare_skin(person, body):
    """The skin in the T-pose as it is without a garment."""
    still = np.zeros((24, 4), np.float32)
    still[:, 0] = 1
    return body.posed(Pose(still, person.joints[0])).vertices


def drawn_in(person, body):
    """Which vertices of the skin are drawn in below the garment."""
    return np.linalg.norm(worn(person.meshes[1], person) - bare_skin(person, body), axis=1) > 1e-5


def skinned(mesh, skeleton, tails, turns, frame):
    """A mesh in one frame of `swing`, as an engine skins it."""
    count = len(mesh.binds)
    rotations = np.concatenate([skeleton.turns[frame], turns[frame]])[:count]
    places = np.concatenate([skeleton.joints[frame], tails[frame]])[:count]
    at = rotations @ mesh.binds
    at[..., 3] += places
    blended = np.einsum("vi,virc->vrc", mesh.weights, at[mesh.bones])
    return np.einsum("vrc,vc->vr", blended[..., :3], mesh.vertices) + blended[..., 3]


def posed_bones(skeleton):
    """Names of VRM's bones, their rotations from the bones above (xyzw) in each frame, and places of the hips."""
    names = [name for name in JOINT_NAMES if name in VRM_BONES]
    turns = []
    for joint in map(JOINT_NAMES.index, names):
        above = skeleton.turns[:, PARENTS[joint]] if joint else np.eye(3)
        turns.append(Rotation.from_matrix(np.swapaxes(above, -1, -2) @ skeleton.turns[:, joint]).as_quat())
    rotations = np.stack(turns, axis=1).reshape(len(skeleton.turns), -1)
    return [VRM_BONES[name] for name in names], rotations.tolist(), skeleton.joints[:, 0].tolist()


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
    swinging = int((hemline.load("cape").ropes.parents >= 0).sum())
    assert found["springs"][0, 0, :2].tolist() == [swinging, len(person.capsules.joints)]
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
    away = np.linalg.norm(lowered["body"][0] - ours, axis=1)[~drawn_in(person, body)]
    assert away.mean() < 1e-4 and away.max() < 0.006


def test_the_body_and_the_cape_are_where_the_player_puts_them(person, body):
    rest, bare = worn(person.meshes[1], person), bare_skin(person, body)
    covered = drawn_in(person, body)
    assert 0.05 < covered.mean() < 0.5
    assert np.abs(rest - bare)[~covered].max() < 1e-5
    assert np.linalg.norm(rest - bare, axis=1).max() < DEPTH + 1e-5
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
    of_all = capsules.chains < 0
    away = distances_to_axes(chains.bones[free], capsules.starts[of_all], capsules.ends[of_all])[0]
    assert (away >= capsules.radii[of_all] - 1e-9).all()


@pytest.mark.parametrize("limits", [False, True], ids=["as released", "with limits"])
def test_three_vrm_moves_the_skirt_as_our_springs_do(body, tmp_path, limits):
    """Joints of three-vrm measure bones as the specification says, or have our limits as well, read from the file."""
    skirt = hemline.load("skirt")
    springs = skirt.springs if limits else replace(skirt.springs, inward=np.pi, sideways=np.pi)
    person = character(replace(skirt, springs=springs), body)
    path = write_vrm(tmp_path / "skirt.vrm", person)[0]
    skeleton = skeleton_of(t_pose(body), hemline.motions.load("run").resample(60.0)[:90])
    tails, turns = swing(person.chains, person.capsules, skeleton)
    frames = [0, 60, 150, 180, 210]
    with three(path.parent) as page:
        found = page("window.playVrm", "/skirt.vrm", *posed_bones(skeleton), frames, True, limits)
    for at, frame in enumerate(frames):
        ours = skinned(person.meshes[0], skeleton, tails, turns, frame)
        away = np.linalg.norm(found["skirt"][at] - ours, axis=1)
        assert away.mean() < 2e-4 and away.max() < 0.005, (frame, away.mean(), away.max())


def test_limits_are_on_all_joints_but_the_last_and_match_the_chains(person, path):
    content = path.read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    document = json.loads(content[20 : 20 + length])
    assert "VRMC_springBone_limit" in document["extensionsUsed"]
    for spring, bones in zip(document["extensions"]["VRMC_springBone"]["springs"], person.chains.spans, strict=True):
        *joints, tip = spring["joints"]
        assert "extensions" not in tip and len(joints) == len(bones) - 1
        for joint, bone in zip(joints, bones[1:], strict=True):
            extension = joint["extensions"]["VRMC_springBone_limit"]
            assert extension["specVersion"] == "1.0-draft"
            limit = extension["limit"]["spherical"]
            x, y, z, w = limit["rotation"]
            assert (y, z) == (0, 0) and x * x + w * w == pytest.approx(1)
            # the range reaches as far inwards as the constant says
            assert limit["pitch"] - 2 * np.arctan2(x, w) == pytest.approx(person.chains.inward[bone], abs=1e-4)
            assert limit["yaw"] == pytest.approx(person.chains.sideways[bone], abs=1e-4)
            # no bone points along its own -y, where limits are unstable
            child = document["nodes"][spring["joints"][joints.index(joint) + 1]["node"]]["translation"]
            assert child[1] > 0


def test_a_model_without_limits_names_no_extension_for_them(body, tmp_path):
    cape = hemline.load("cape")
    free = character(replace(cape, springs=replace(cape.springs, inward=np.pi, sideways=np.pi)), body)
    content = write_vrm(tmp_path / "free.vrm", free)[0].read_bytes()
    assert b"VRMC_springBone_limit" not in content


def test_the_skin_below_a_garment_gives_it_room(person, body):
    """Covered skin is drawn in along its normal, up to 15 mm far from the garment's edge; hands stay as they are."""
    bare, covered = bare_skin(person, body), drawn_in(person, body)
    moved = bare - worn(person.meshes[1], person)
    still = np.zeros((24, 4), np.float32)
    still[:, 0] = 1
    inwards = np.einsum("vx,vx->v", moved, body.posed(Pose(still, person.joints[0])).normals)
    np.testing.assert_allclose(inwards[covered], np.linalg.norm(moved, axis=1)[covered], atol=1e-5)
    tree = ClosestTree(worn(person.meshes[0], person), person.meshes[0].faces)
    closest = tree.closest(bare)
    edge = np.concatenate([tree.vertices[loop] for loop in boundary_loops(person.meshes[0].faces)])
    from_edge = KDTree(edge).query(closest.positions)[0]
    assert np.allclose(inwards[covered], DEPTH * np.clip(from_edge / FADE, 0, 1)[covered], atol=1e-5)
    assert (inwards > 0.99 * DEPTH).sum() > 500
    largest = person.meshes[1].weights.argmax(axis=1)
    largest = np.take_along_axis(person.meshes[1].bones, largest[:, None], axis=1)[:, 0]
    assert not covered[np.isin(largest, [JOINT_NAMES.index("left_hand"), JOINT_NAMES.index("right_hand")])].any()


@pytest.mark.parametrize("count", [1, 2])
def test_a_vertex_follows_no_more_bones_than_asked(body, count):
    person = character(hemline.load("cape"), body, influences=count)
    for mesh in person.meshes:
        assert (mesh.weights > 0).sum(axis=1).max() == count
        assert np.allclose(mesh.weights.sum(axis=1), 1)


def test_another_number_of_bones_is_refused(body):
    with pytest.raises(BadInput, match="follows one to four bones; got influences = 5"):
        character(hemline.load("cape"), body, influences=5)


def test_the_table_returns_a_bone_by_the_fraction_that_vrm_does(person, tmp_path):
    """A bone that is turned a little from rest and has no weight is back by the table's fraction one frame later."""
    table = tmp_path / "springs.json"
    write_spring_table(table, person)
    rows = json.loads(table.read_text())["chains"]
    chains, bone = person.chains, 3
    stiffness = chains.stiffness[bone]
    length = np.linalg.norm(chains.bones[bone] - chains.bones[bone - 1])
    turned = 0.01
    tail = length * np.array([np.sin(turned), -np.cos(turned)]) + stiffness / 60 * np.array([0.0, -1.0])
    left = np.arctan2(tail[0], -tail[1])
    assert rows[0]["KawaiiPhysics"]["Stiffness"][bone - 1] == pytest.approx(1 - left / turned, abs=1e-3)
    assert rows[0]["PhysBones"]["Momentum"][bone - 1] == pytest.approx(1 - chains.drag[bone], abs=1e-4)
    falls = rows[0]["KawaiiPhysics"]["Gravity.Z"][bone - 1] / 100 / 60**2 / 2
    assert falls == pytest.approx(-chains.gravity[bone] / 60, abs=1e-5)
    names = {name for row in rows for name in (row["root"], *row["bones"])}
    assert len(names) == len(chains.bones)


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
    chains = hemline.load("skirt").ropes.chains
    assert (said["chains"], said["bones"]) == (36, chains.offsets[-1] - chains.offsets[0])
    assert said["bytes"] == (tmp_path / "skirt.vrm").stat().st_size < 3e6


@pytest.mark.parametrize("model", ["live", "tshirt-light"])
def test_the_command_refuses_a_model_without_chains(model, tmp_path, capsys):
    assert main(["character", model, "-o", str(tmp_path / "out.vrm")]) == 2
    err = capsys.readouterr().err
    assert err.splitlines()[-1].startswith("hemline: spring bones are made of rope chains") and err.count("\n") == 2
    assert "a model of kind" in err
    assert not (tmp_path / "out.vrm").exists()


def test_characters_are_read_by_the_names_that_ours_are_written_with():
    assert VRM.items() <= VRM_BONES.items(), "export knows nothing of motions, so the names stand in both"
