"""Characters that are not ours become bodies: what is found is right, and said; what is none is refused in a line."""

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies, motions
from hemline.bodies import read_character
from hemline.bodies.place import sole_vertices
from hemline.errors import BadBody, BadMotion
from hemline.meshes import ClosestTree, boundary_loops, components
from hemline.motions import JOINT_NAMES, PARENTS, Pose
from tests.bodies.character_samples import CUSTOMS, Sample, small_body, write_character

SIDES = [JOINT_NAMES.index(name) for name in ("left_hip", "right_hip")]


def midway(joints):
    """Places seen from midway between the hips, where a character has its pelvis."""
    return joints[1:] - joints[SIDES].mean(axis=0)


def parts_of(centres):
    return np.where(centres[:, 1] > 0.45, "Head", "Suit")


@pytest.mark.parametrize("custom", [name for name in CUSTOMS if name != "nameless"])
def test_bones_of_all_customs_are_found_by_their_names(custom, tmp_path):
    body, found = read_character(write_character(tmp_path / "it.glb", Sample(names=CUSTOMS[custom])))
    ours = small_body()
    assert np.abs(midway(body.joints) - midway(ours.joints)).max() < 1e-5
    assert np.abs(body.weights - ours.weights).max() < 1e-5
    assert np.array_equal(body.faces, ours.faces)
    assert "joints found by the names of the bones" in found.notes
    assert len(body.shapedirs) == 0 and body.licence == "CC0, made for a test"


@pytest.mark.parametrize("version", [0, 1])
def test_a_vrm_is_found_by_its_own_map(version, tmp_path):
    body, found = read_character(write_character(tmp_path / "it.vrm", Sample(names=CUSTOMS["nameless"], vrm=version)))
    assert "joints found by the file's own VRM map" in found.notes
    assert np.abs(midway(body.joints)[:-2] - midway(small_body().joints)[:-2]).max() < 1e-5
    assert any("no bone for left_hand, right_hand" in note for note in found.notes)
    assert "nobody" in body.licence


def test_a_rig_whose_names_say_nothing_is_found_by_its_shape(tmp_path):
    body, found = read_character(write_character(tmp_path / "it.gltf", Sample(names=CUSTOMS["nameless"])))
    assert np.abs(midway(body.joints)[:-2] - midway(small_body().joints)[:-2]).max() < 1e-5
    (how,) = [note for note in found.notes if "joints found by" in note]
    assert "their place in the tree, since it.gltf lacks the joint 'head'" in how and "left_knee 'Bone.004'" in how


@pytest.mark.parametrize(
    ("sample", "said"),
    [
        (Sample(scale=100), "unit cm, guessed from the size: legs of 81.7"),
        (Sample(scale=10), "unit dm, guessed"),
        (Sample(scale=1, armature=0.01), "unit m, guessed"),
        (Sample(z_up=True), "z up, facing -y: turned to y up, facing z"),
        (Sample(scale=100, z_up=True), "unit cm, guessed"),
        (
            Sample(pose={"pelvis": (0.2, 0, 0), "left_hip": (-0.6, 0, 0), "left_shoulder": (0, 0, 0.5)}),
            "the file shows a pose",
        ),
        (Sample(loose=380), "404 bones, 24 of them ours; 380 others go with the joint above them"),
        (Sample(extra=1), "32 bones, 24 of them ours"),
    ],
    ids=["centimetres", "decimetres", "armature", "z up", "both", "posed", "400 bones", "twists"],
)
def test_unit_axes_pose_and_bones_beside_do_not_matter_and_are_said(sample, said, tmp_path):
    body, found = read_character(write_character(tmp_path / "it.glb", sample))
    plain = sample.body
    assert any(said in note for note in found.notes)
    moved = body.template - body.joints[1] - (plain.template - plain.joints[1])
    assert np.abs(moved).max() < 2e-5
    assert np.abs(body.weights - plain.weights).max() < 1e-5


def test_height_and_unit_are_taken_as_given(tmp_path):
    path = write_character(tmp_path / "it.glb", Sample(scale=30))
    with pytest.raises(
        BadBody, match="contradicts the size of it.glb; got legs of 24.5 m; the size fits 'inch', or say"
    ):
        read_character(path, unit="m")
    body, found = read_character(path, height=1.5)
    assert np.ptp(body.template[:, 1]) == pytest.approx(1.5, abs=1e-4)
    assert any("to be 1.5 m tall" in note for note in found.notes)
    with pytest.raises(BadBody, match="height and unit exclude each other"):
        read_character(path, height=1.5, unit="cm")
    with pytest.raises(BadBody, match="a height must be that of a person in metres; got 150"):
        read_character(path, height=150)
    with pytest.raises(BadBody, match="has the size of no person"):
        read_character(write_character(tmp_path / "doll.glb", Sample(scale=0.1)))


def test_a_shorter_rig_has_no_joints_of_its_own_there(tmp_path):
    """One bone of the spine, no neck, collars, toes or hands: their skin follows the joint above."""
    gone = (
        "spine1",
        "spine2",
        "neck",
        "left_collar",
        "right_collar",
        "left_foot",
        "right_foot",
        "left_hand",
        "right_hand",
    )
    names = {joint: name for joint, name in CUSTOMS["mixamo"].items() if joint not in gone}
    body, found = read_character(write_character(tmp_path / "it.glb", Sample(names=names)))
    used = {JOINT_NAMES[joint] for joint in np.unique(body.weight_indices[body.weights > 0])}
    assert used == set(names)
    assert any(note.startswith("no bone for spine1, spine2, left_foot") for note in found.notes)
    assert np.abs(body.joints[[JOINT_NAMES.index("spine3")]] - body.joints[0]).max() > 0.2
    posed = body.shaped().posed(Pose(np.tile([1.0, 0, 0, 0], (24, 1)), np.zeros(3)))
    assert posed.vertices[:, 0].max() > 0.7  # arms reach out in the T-pose


def played(sample, rotations):
    """The skin of a sample whose joints turn, by scipy: parents first, then the mean over the joints of each vertex."""
    body = sample.body
    joints, weights = body.joints.astype(float), np.zeros((len(body.template), 24))
    np.add.at(weights, (np.arange(len(weights))[:, None], body.weight_indices), body.weights)
    frames = []
    for frame in rotations:
        turned, places = [], []
        for joint, parent in enumerate(PARENTS):
            own = Rotation.from_quat(frame[joint, [1, 2, 3, 0]])
            turned.append(own if parent < 0 else turned[parent] * own)
            places.append(
                joints[joint] if parent < 0 else places[parent] + turned[parent].apply(joints[joint] - joints[parent])
            )
        moved = [turned[j].apply(body.template - joints[j]) + places[j] for j in range(24)]
        frames.append(np.einsum("vj,jvc->vc", weights, np.array(moved)))
    return np.array(frames)


@pytest.mark.parametrize("form", [Sample(), Sample(scale=100, z_up=True)], ids=["plain", "centimetres, z up"])
def test_its_own_animation_moves_it_as_the_file_says(form, tmp_path):
    turns = Rotation.from_rotvec(np.random.default_rng(5).normal(scale=0.25, size=(6 * 24, 3)))
    rotations = turns.as_quat()[:, [3, 0, 1, 2]].reshape(6, 24, 4)
    for side in ("left", "right"):  # a hand goes with its wrist
        rotations[:, JOINT_NAMES.index(f"{side}_hand")] = [1, 0, 0, 0]
    upright = rotations
    if form.z_up:  # in the axes of the file
        z_up = Rotation.from_euler("x", 90, degrees=True)
        rotations = (z_up * turns * z_up.inv()).as_quat()[:, [3, 0, 1, 2]].reshape(6, 24, 4)
        rotations[:, [JOINT_NAMES.index(f"{side}_hand") for side in ("left", "right")]] = [1, 0, 0, 0]
    clips = {"rest": (np.arange(2) / 4, rotations[:2]), "sway": (np.arange(6) / 24, rotations)}
    path = write_character(tmp_path / "it.glb", replace(form, clips=clips))
    shaped, motion = read_character(path)[0].shaped(), motions.open_motion(f"{path}:sway")
    assert (motion.name, motion.fps, len(motion)) == ("sway", 24.0, 6)
    truth = played(form, upright)
    for frame in range(6):
        posed = shaped.posed(motion[frame])
        apart = posed.vertices - posed.joints[[1]] - (truth[frame] - truth[frame][None, 0])
        apart = apart - apart[0]
        assert np.linalg.norm(apart, axis=1).max() < 1e-4


def test_animations_are_named(tmp_path):
    still = np.tile([1.0, 0, 0, 0], (3, 24, 1))
    clips = {name: (np.arange(3) / 30, still) for name in ("walk", "run")}
    path = write_character(tmp_path / "it.glb", Sample(clips=clips))
    assert motions.read(f"{path}:1").name == "run"
    with pytest.raises(BadMotion, match=r"has 2 animations; got walk, run; name one: .*it.glb:walk"):
        motions.read(path)
    with pytest.raises(BadMotion, match=r"has no animation 'jump'; got walk, run; name one of them"):
        motions.read(f"{path}:jump")
    with pytest.raises(BadMotion, match=r"has no animation; got none"):
        motions.read(write_character(tmp_path / "still.glb", Sample()))


def test_eyes_and_hair_are_left_out_of_what_cloth_lies_on(tmp_path):
    """Balls on the head, skinned as it is, in a mesh of their own."""
    body = small_body()
    head, ball = JOINT_NAMES.index("head"), body.template[:4] * 0.02
    eyes = np.array([[0, 0, 0], [0.02, 0, 0], [0, 0.02, 0], [0, 0, 0.02]]) + body.joints[head] + [0, 0.05, 0.12]
    count = len(body.template)
    more = replace(
        body,
        template=np.concatenate([body.template, eyes]),
        faces=np.concatenate([body.faces, count + np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])]),
        shapedirs=np.zeros((0, count + len(ball), 3)),
        joint_shapedirs=np.zeros((0, 24, 3)),
        weight_indices=np.concatenate([body.weight_indices, np.full((4, 6), head)]),
        weights=np.concatenate([body.weights, np.eye(6)[:1].repeat(4, 0)]),
    )
    sample = Sample(
        body=more, parts=lambda centres: np.where(np.arange(len(centres)) < len(body.faces), "Skin", "Eyes")
    )
    made, found = read_character(write_character(tmp_path / "it.glb", sample))
    assert len(made.template) == count
    assert "left out of it: 1 other part, of 'Eyes'" in found.notes
    assert "cloth lies on its own skin, 'Skin', which is closed" in found.notes


def test_an_open_crown_is_closed_by_a_cap(tmp_path):
    sample = Sample(parts=lambda centres: np.where(centres[:, 1] > centres[:, 1].max() - 0.03, "", "Skin"))
    body, found = read_character(write_character(tmp_path / "it.glb", sample))
    assert boundary_loops(body.faces) == ()
    assert any("holes closed by" in note for note in found.notes)


def test_clothes_in_the_place_of_skin_are_closed_by_a_shell(tmp_path):
    """A belt of 3 cm is missing all around: the shell bridges it, and lies on the skin elsewhere."""

    def belted(centres):
        belt = (np.abs(centres[:, 1] - 0.12) < 0.015) & (np.abs(centres[:, 0]) < 0.3)
        return np.where(belt, "", parts_of(centres))

    body, found = read_character(write_character(tmp_path / "it.glb", Sample(parts=belted)))
    assert any("closed by a shell of 9000 vertices, since its skin has holes" in note for note in found.notes)
    assert boundary_loops(body.faces) == ()
    assert components(body.faces, len(body.template)).max() == 0
    ours = small_body()
    apart = np.abs(
        ClosestTree(ours.template - ours.joints[1] + body.joints[1], ours.faces).signed_distances(body.template)
    )
    assert apart.mean() < 5e-4 and np.quantile(apart, 0.95) < 2e-3


def test_a_body_file_keeps_it_and_every_reader_takes_it(tmp_path):
    path = write_character(tmp_path / "it.glb", Sample())
    body = bodies.read(path)
    bodies.write(tmp_path / "it.safetensors", body)
    assert bodies.read(tmp_path / "it.safetensors").hash == body.hash == bodies.load(str(path)).hash
    assert bodies.load(str(path)).name == str(path)
    with pytest.raises(BadBody, match="'it' has 0 betas; got 1"):
        body.shaped([1.0])


def edited(path, change):
    """The file with its document changed."""
    content = path.read_bytes()
    length = struct.unpack_from("<I", content, 12)[0]
    document, rest = json.loads(content[20 : 20 + length]), content[20 + length :]
    change(document)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    head = struct.pack("<4sII", b"glTF", 2, 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON")
    path.write_bytes(head + text + rest)
    return path


def skinless(document):
    del document["skins"]
    for node in document["nodes"]:
        node.pop("skin", None)


def three_bones(document):
    document["skins"][0]["joints"] = document["skins"][0]["joints"][:3]
    for node in document["nodes"][4:]:
        node["mesh"] = 0
    for node in document["nodes"][1:4]:
        node.pop("children", None)


def nan(weights):
    weights[7] = np.nan
    return weights


def negative(weights):
    weights[7, 0] = -1
    return weights


@pytest.mark.parametrize(
    ("sample", "change", "said"),
    [
        (Sample(), skinless, r"has no skin; got 1 meshes without bones; skin its mesh to an armature"),
        (Sample(), three_bones, r"is no humanoid; got 3 bones; a body needs hips, knees"),
        (Sample(weights=nan), None, r"weights of 'Body' must be finite; got NaN or infinity; normalise"),
        (Sample(weights=negative), None, r"weights of 'Body' must not be negative; got -1"),
        (Sample(weights=np.zeros_like), None, r"must have weights; got none above 0"),
        (
            Sample(names={j: f"b{j}" for j in JOINT_NAMES}, pose={}, parts=None),
            lambda document: (
                [node.update(translation=[0, 0.1, 0]) for node in document["nodes"][2:25]]
                and document["skins"][0].pop("inverseBindMatrices")
            ),
            r"no humanoid was found in .*it.glb: it.glb lacks the joint 'head'; got .*; name its bones as Mixamo",
        ),
        (Sample(), lambda document: document["nodes"][3].update(children=[1]), r"is damaged; got an entry that"),
        (Sample(), lambda document: document["asset"].update(version="1.0"), r"must be glTF 2.0; got version 1.0"),
        (
            Sample(parts=lambda centres: np.where(centres[:, 1] > 0.5, "Head", "")),
            None,
            r"cannot be closed: no connected part of it reaches head, hands and feet; got a surface without a left arm",
        ),
        (Sample(parts=lambda centres: np.full(len(centres), "")), None, r"has no triangles that bones move"),
    ],
    ids=["no skin", "3 bones", "NaN", "negative", "none", "no humanoid", "circle", "version", "head", "empty"],
)
def test_what_is_no_character_is_refused_in_a_line(sample, change, said, tmp_path):
    path = write_character(tmp_path / "it.glb", sample)
    if change is not None:
        edited(path, change)
    with pytest.raises(BadBody, match=said) as found:
        bodies.read(path)
    assert str(found.value).isprintable()


def test_broken_files_are_refused_in_a_line(tmp_path):
    path = write_character(tmp_path / "it.glb", Sample())
    content = path.read_bytes()
    for broken in (content[:100], content[:-1000], b"glTF", b"", b"\x80\x04}.", content[:20] + b"[" + content[21:]):
        path.write_bytes(broken)
        with pytest.raises(BadBody, match=r"(is cut off|cannot be read as|is damaged|no entry 'asset')"):
            bodies.read(path)
    with pytest.raises(BadBody, match="cannot read .*absent.glb; got No such file"):
        bodies.read(tmp_path / "absent.glb")


def test_joints_may_be_in_any_order_of_nodes(tmp_path):
    """A file whose nodes come in the opposite order holds the same character."""

    def backwards(document):
        count = len(document["nodes"])
        turned = [count - 1 - node for node in range(count)]
        for node in document["nodes"]:
            node["children"] = [turned[child] for child in node.get("children", [])]
            if not node["children"]:
                del node["children"]
        document["nodes"].reverse()
        document["skins"][0]["joints"] = [turned[joint] for joint in document["skins"][0]["joints"]]
        document["scenes"][0]["nodes"] = [turned[node] for node in document["scenes"][0]["nodes"]]

    plain = bodies.read(write_character(tmp_path / "it.glb", Sample()))
    other = bodies.read(edited(write_character(tmp_path / "other.glb", Sample()), backwards))
    assert other.hash == plain.hash


def test_boots_in_a_mesh_of_their_own_are_part_of_the_surface(tmp_path):
    """Legs that end in boots are no whole skin: without its feet a body has no soles to stand on."""
    body = small_body()
    strongest = np.take_along_axis(body.weight_indices, body.weights.argmax(axis=1)[:, None], axis=1)[:, 0]
    feet = [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "foot")]
    is_boot = np.isin(strongest, feet)[body.faces].any(axis=1)
    count = len(body.template)
    boots = replace(
        body,
        template=np.concatenate([body.template, body.template - [0, 0.004, 0]]),
        faces=np.concatenate([body.faces[~is_boot], body.faces[is_boot] + count]),
        shapedirs=np.zeros((0, 2 * count, 3)),
        weight_indices=np.concatenate([body.weight_indices] * 2),
        weights=np.concatenate([body.weights] * 2),
    )
    path = write_character(tmp_path / "boots.glb", Sample(body=boots))
    found, character = read_character(path)
    assert any("closed by a shell" in note for note in character.notes)
    assert abs(found.template[:, 1].min() - body.template[:, 1].min()) < 0.02
    assert len(sole_vertices(found.shaped())) > 10


def test_a_body_whose_shins_move_its_boots_has_soles():
    """Where no vertex follows a foot alone, those that follow it most are the soles."""
    body = small_body()
    feet = [JOINT_NAMES.index(f"{side}_{name}") for side in ("left", "right") for name in ("ankle", "foot")]
    knee = JOINT_NAMES.index("left_knee")
    weights, indices = np.zeros_like(body.weights), body.weight_indices.copy()
    weights[:, :2], indices[:, 1] = 0.5, knee
    indices[:, 0] = np.where(np.isin(body.weight_indices, feet).any(axis=1), feet[0], 0)
    soles = sole_vertices(replace(body, weights=weights, weight_indices=indices).shaped())
    height = body.template[:, 1]
    assert len(soles) and (height[soles] < height.min() + 0.031).all()
