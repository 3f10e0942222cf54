"""A character's own file with a garment: read by pygltflib and skinned here, judged by Khronos, played by Blender."""

import numpy as np
import pygltflib
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies, motions
from hemline.errors import BadInput
from hemline.export import Clip, ClipSkeleton, skin_clip, write_dressed
from hemline.motions import JOINT_NAMES, Pose
from hemline.playback import own_mesh
from tests.bodies.character_samples import CUSTOMS, Sample, write_character
from tests.export.test_export_blender import BLENDER, played
from tests.export.web import validated

FORMS = {
    "centimetres, z up": Sample(scale=100, z_up=True, extra=1, loose=12),
    "armature": Sample(names=CUSTOMS["unreal"], armature=0.01),
    "VRM": Sample(names=CUSTOMS["nameless"], vrm=1, pose={"left_hip": (-0.5, 0, 0)}),
}


def dressed(folder, sample, *, bones=0):
    """A path that was written, the body's vertices in each frame, and the clip."""
    path = write_character(folder / "me.glb", sample)
    shaped = bodies.read(path).shaped()
    turns = Rotation.from_rotvec(np.random.default_rng(1).normal(scale=0.3, size=(5 * 24, 3))).as_quat()
    rotations = turns[:, [3, 0, 1, 2]].reshape(5, 24, 4)
    for side in ("left", "right"):  # not every rig here has bones there
        rotations[:, JOINT_NAMES.index(f"{side}_hand")] = [1, 0, 0, 0]
    posed = [shaped.posed(Pose(each, np.array([0.1 * frame, 1, 0]))) for frame, each in enumerate(rotations)]
    body = shaped.body
    transforms = np.stack([each.transforms for each in posed])
    names = motions.JOINT_NAMES
    skeleton = ClipSkeleton(
        shaped.joints, body.parents, transforms, shaped.vertices, body.weight_indices, body.weights, names
    )
    vertices = np.stack([each.vertices for each in posed])
    cloth = (1.01 * vertices[:, :40]).astype(np.float32)
    faces = np.array([[k, k + 1, k + 2] for k in range(38)])
    clip = Clip(cloth, faces, 30.0, vertices, body.faces, "scarf", skeleton=skeleton, notices=("CC0 motion",))
    if bones:
        clip = skin_clip(clip, bones)
    (out,) = write_dressed(folder / "dressed.glb", clip, own_mesh(path, shaped))
    return out, vertices, clip


def read_array(gltf, number):
    kinds = {5126: "<f4", 5125: "<u4", 5123: "<u2", 5121: "<u1"}
    widths = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
    accessor = gltf.accessors[number]
    view = gltf.bufferViews[accessor.bufferView]
    dtype, width = np.dtype(kinds[accessor.componentType]), widths[accessor.type]
    start = (view.byteOffset or 0) + (accessor.byteOffset or 0)
    stride = view.byteStride or dtype.itemsize * width
    rows = np.ndarray((accessor.count, width), dtype, gltf.binary_blob(), start, (stride, dtype.itemsize))
    return rows.astype(np.float64)


def skinned_here(path, name, frame):
    """Vertices of one skinned mesh in one frame, as the format says."""
    gltf = pygltflib.GLTF2().load(str(path))
    parts = [{k: getattr(node, k) for k in ("translation", "rotation", "scale")} for node in gltf.nodes]
    (animation,) = gltf.animations
    for channel in animation.channels:
        if channel.target.path != "weights":
            values = read_array(gltf, animation.samplers[channel.sampler].output)
            parts[channel.target.node][channel.target.path] = values[frame]
    local = []
    for part in parts:
        matrix = np.eye(4)
        given = {key: value for key, value in part.items() if value is not None}
        turn = Rotation.from_quat(given.get("rotation", [0, 0, 0, 1]))
        matrix[:3, :3] = turn.as_matrix() * np.asarray(given.get("scale", [1, 1, 1]))
        matrix[:3, 3] = given.get("translation", 0)
        local.append(matrix)
    world, parents = {}, {child: node for node, each in enumerate(gltf.nodes) for child in each.children or []}

    def placed(node):
        if node not in world:
            world[node] = placed(parents[node]) @ local[node] if node in parents else local[node]
        return world[node]

    (node,) = [each for each in gltf.nodes if each.name == name]
    skin, primitive = gltf.skins[node.skin], gltf.meshes[node.mesh].primitives[0]
    binds = read_array(gltf, skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    bones = np.array([placed(joint) for joint in skin.joints]) @ binds
    places = read_array(gltf, primitive.attributes.POSITION)
    points = np.c_[places, np.ones(len(places))]
    total = np.zeros((len(points), 3))
    for four in range(2):
        joints = getattr(primitive.attributes, f"JOINTS_{four}")
        weights = read_array(gltf, getattr(primitive.attributes, f"WEIGHTS_{four}"))
        moved = np.einsum("vkrc,vc->vkr", bones[read_array(gltf, joints).astype(int)], points)
        total += np.einsum("vk,vkr->vr", weights, moved[..., :3])
    return total


@pytest.mark.parametrize("form", FORMS)
def test_its_own_mesh_moves_as_its_body(form, tmp_path):
    path, vertices, _ = dressed(tmp_path, FORMS[form])
    for frame in (0, 4):
        assert np.abs(skinned_here(path, "Body", frame) - vertices[frame]).max() < 1e-4


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("bones", [0, 4])
def test_khronos_finds_no_error(form, bones, tmp_path):
    path, _, _ = dressed(tmp_path, FORMS[form], bones=bones)
    (said,) = validated(path)
    assert said["numErrors"] == 0, said["messages"][:5]


def test_it_is_read_back_as_a_clip_and_as_a_character(tmp_path):
    path, vertices, _ = dressed(tmp_path, FORMS["centimetres, z up"])
    document = pygltflib.GLTF2().load(str(path))
    assert document.asset.copyright == "CC0, made for a test; CC0 motion"
    assert {mesh.name for mesh in document.meshes} == {"Body", "scarf"}
    shaped, motion = bodies.read(tmp_path / "me.glb").shaped(), motions.read(path)
    assert (len(motion), motion.fps) == (5, 30.0)
    for frame in range(5):
        posed = shaped.posed(motion[frame])
        apart = posed.vertices - posed.vertices[:1] - (vertices[frame] - vertices[frame, :1])
        assert np.abs(apart).max() < 1e-4


def test_springs_and_animations_of_the_file_are_left_out(tmp_path):
    still = np.tile([1.0, 0, 0, 0], (3, 24, 1))
    sample = Sample(names=CUSTOMS["nameless"], vrm=0, clips={"idle": (np.arange(3) / 30, still)})
    path, _, _ = dressed(tmp_path, sample)
    document = pygltflib.GLTF2().load(str(path))
    assert [each.name for each in document.animations] == ["clip"]
    assert not document.extensions and not document.extensionsUsed


def test_another_body_is_refused(tmp_path):
    path = write_character(tmp_path / "me.glb", Sample())
    with pytest.raises(BadInput, match=r"body 'anny24' was not made of .*me.glb; got joints that are \d+ mm apart"):
        own_mesh(path, bodies.load().shaped([2.0]))
    shaped = bodies.read(path).shaped()
    clip = Clip(np.zeros((1, 3, 3), np.float32), np.array([[0, 1, 2]]), 30.0)
    with pytest.raises(BadInput, match="follows the skeleton of its body; got a clip without one"):
        write_dressed(tmp_path / "out.glb", clip, own_mesh(path, shaped))
    assert not (tmp_path / "out.glb").exists()


@pytest.mark.slow
@pytest.mark.skipif(BLENDER is None, reason="HEMLINE_BLENDER_PYTHON is not set: see tests/export/blender/README.md")
@pytest.mark.parametrize("form", FORMS)
def test_blender_plays_it(form, tmp_path):
    path, vertices, clip = dressed(tmp_path, FORMS[form])
    read = played(path, clip, tmp_path)
    assert 1000 * np.linalg.norm(read["Body"] - vertices, axis=2).max() < 0.1
    assert 1000 * np.linalg.norm(read["scarf"] - clip.vertices, axis=2).max() < 0.1
