"""GLB, read back with pygltflib and played by the format's own rules."""

# pygltflib says that everything may be None
# pyright: reportAttributeAccessIssue=false, reportOptionalMemberAccess=false, reportCallIssue=false, reportArgumentType=false, reportOptionalIterable=false, reportOperatorIssue=false

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from pygltflib import GLTF2
from scipy.spatial.transform import Rotation, Slerp

from hemline.export import write

SHAPES = {"SCALAR": (), "VEC3": (3,), "VEC4": (4,), "MAT4": (4, 4)}
TYPES = {5126: np.float32, 5125: np.uint32, 5123: np.uint16, 5122: np.int16, 5121: np.uint8, 5120: np.int8}


def values(gltf, index):
    accessor = gltf.accessors[index]
    view = gltf.bufferViews[accessor.bufferView]
    assert view.byteOffset % 4 == 0
    dtype, columns = np.dtype(TYPES[accessor.componentType]), int(np.prod(SHAPES[accessor.type]))
    step = view.byteStride or columns * dtype.itemsize
    assert step % 4 == 0 or not view.target or view.target == 34963
    content = np.frombuffer(gltf.binary_blob(), np.uint8, view.byteLength, view.byteOffset)
    rows = content[: accessor.count * step].reshape(accessor.count, step)[:, : columns * dtype.itemsize]
    array = np.ascontiguousarray(rows).view(dtype).reshape(accessor.count, *SHAPES[accessor.type])
    if accessor.max:
        rows = array.reshape(len(array), -1)
        np.testing.assert_array_equal(np.float32(accessor.min), rows.min(axis=0))
        np.testing.assert_array_equal(np.float32(accessor.max), rows.max(axis=0))
    return array / np.iinfo(dtype).max if accessor.normalized else array


def channel(gltf, node, path):
    animation = gltf.animations[0]
    found = [each for each in animation.channels if each.target.node == node and each.target.path == path]
    if not found:
        return None
    sampler = animation.samplers[found[0].sampler]
    assert sampler.interpolation == "LINEAR"
    return values(gltf, sampler.input), values(gltf, sampler.output)


def morphed(gltf, node, seconds):
    mesh = gltf.meshes[gltf.nodes[node].mesh]
    primitive = mesh.primitives[0]
    times, weights = channel(gltf, node, "weights") or pytest.fail("the weights are not animated")
    weights = weights.reshape(len(times), len(primitive.targets))
    now = np.array([np.interp(seconds, times, column) for column in weights.T])
    targets = np.stack([values(gltf, target["POSITION"]) for target in primitive.targets])
    return values(gltf, primitive.attributes.POSITION) + np.tensordot(now, targets, 1)


def world(gltf, node, seconds, parents):
    matrix = np.eye(4)
    moved, turned = channel(gltf, node, "translation"), channel(gltf, node, "rotation")
    matrix[:3, 3] = gltf.nodes[node].translation
    if moved is not None:
        matrix[:3, 3] = [np.interp(seconds, moved[0], axis) for axis in moved[1].T]
    if turned is not None:
        matrix[:3, :3] = Slerp(turned[0], Rotation.from_quat(turned[1]))(seconds).as_matrix()
    return world(gltf, parents[node], seconds, parents) @ matrix if node in parents else matrix


def skinned(gltf, node, seconds):
    skin, primitive = gltf.skins[gltf.nodes[node].skin], gltf.meshes[gltf.nodes[node].mesh].primitives[0]
    parents = {child: parent for parent, each in enumerate(gltf.nodes) for child in each.children or []}
    binds = np.swapaxes(values(gltf, skin.inverseBindMatrices), 1, 2)
    matrices = np.stack([world(gltf, joint, seconds, parents) for joint in skin.joints]) @ binds
    attributes = primitive.attributes
    indices = np.concatenate([values(gltf, attributes.JOINTS_0), values(gltf, attributes.JOINTS_1)], axis=1)
    weights = np.concatenate([values(gltf, attributes.WEIGHTS_0), values(gltf, attributes.WEIGHTS_1)], axis=1)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
    assert (np.diff(weights, axis=1) <= 0).all()  # the largest four first
    rest = values(gltf, attributes.POSITION)
    points = np.concatenate([rest, np.ones((len(rest), 1))], axis=1)
    return np.einsum("vk,vkrc,vc->vr", weights, matrices[indices][..., :3, :], points)


def test_the_garment_is_exact_at_each_frames_time(tmp_path, full_clip):
    write(tmp_path / "a.glb", full_clip)
    gltf = GLTF2().load(tmp_path / "a.glb")
    node = next(index for index, each in enumerate(gltf.nodes) if each.name == "red cape")
    for frame, expected in enumerate(full_clip.vertices):
        np.testing.assert_allclose(morphed(gltf, node, frame / 24), expected, atol=2e-6)
    between = 0.5 * (full_clip.vertices[2] + full_clip.vertices[3])
    np.testing.assert_allclose(morphed(gltf, node, 2.5 / 24), between, atol=2e-6)
    primitive = gltf.meshes[gltf.nodes[node].mesh].primitives[0]
    np.testing.assert_array_equal(values(gltf, primitive.indices), full_clip.faces.ravel())


def test_the_body_follows_its_joints_exactly(tmp_path, full_clip):
    write(tmp_path / "a.glb", full_clip)
    gltf = GLTF2().load(tmp_path / "a.glb")
    node = next(index for index, each in enumerate(gltf.nodes) if each.skin is not None)
    for frame, expected in enumerate(full_clip.body_vertices):
        np.testing.assert_allclose(skinned(gltf, node, frame / 24), expected, atol=3e-6)
    primitive = gltf.meshes[gltf.nodes[node].mesh].primitives[0]
    normals = values(gltf, primitive.attributes.NORMAL)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)
    judge = trimesh.Trimesh(values(gltf, primitive.attributes.POSITION), full_clip.body_faces, process=False)
    assert (np.sum(normals * judge.vertex_normals, axis=1) > 0.99).all()
    assert [gltf.nodes[joint].name for joint in gltf.skins[0].joints] == list("abcde")


def test_a_body_without_a_skeleton_is_morphed(tmp_path, full_clip):
    clip = replace(full_clip, skeleton=None)
    write(tmp_path / "a.glb", clip)
    gltf = GLTF2().load(tmp_path / "a.glb")
    assert not gltf.skins
    node = next(index for index, each in enumerate(gltf.nodes) if each.name == "body")
    np.testing.assert_allclose(morphed(gltf, node, 5 / 24), clip.body_vertices[5], atol=2e-6)


def test_the_clips_time_and_notices_are_in_the_file(tmp_path, full_clip):
    write(tmp_path / "a.glb", full_clip)
    gltf = GLTF2().load(tmp_path / "a.glb")
    for sampler in gltf.animations[0].samplers:
        np.testing.assert_allclose(values(gltf, sampler.input), np.arange(7) / 24, atol=1e-7)
    assert "CC0" in gltf.asset.copyright
    assert "NSF EIA-0196217" in gltf.asset.copyright
    assert len(gltf.materials) == 2
    assert gltf.materials[0].doubleSided


def test_one_frame_has_no_animation(tmp_path, cloth_clip):
    still = replace(cloth_clip, vertices=cloth_clip.vertices[:1])
    write(tmp_path / "a.glb", still)
    gltf = GLTF2().load(tmp_path / "a.glb")
    assert not gltf.animations
    scene = trimesh.load(tmp_path / "a.glb", process=False)
    (mesh,) = scene.geometry.values()
    np.testing.assert_array_equal(np.asarray(mesh.vertices, np.float32), still.vertices[0])


def test_normals_turn_with_the_frames(tmp_path, full_clip):
    write(tmp_path / "a.glb", full_clip)
    gltf = GLTF2().load(tmp_path / "a.glb")
    primitive = gltf.meshes[0].primitives[0]
    rest = values(gltf, primitive.attributes.NORMAL)
    for target, vertices in zip(primitive.targets, full_clip.vertices[1:], strict=True):
        judge = trimesh.Trimesh(vertices, full_clip.faces, process=False).vertex_normals
        assert (np.sum((rest + values(gltf, target["NORMAL"])) * judge, axis=1) > 0.99).all()


def test_the_size_is_that_of_its_positions_and_normals(tmp_path, full_clip):
    path = write(tmp_path / "a.glb", full_clip)[0]
    garment = 2 * full_clip.vertices.nbytes + full_clip.faces.nbytes / 2
    body = full_clip.body_vertices.shape[1] * (24 + 40) + full_clip.body_faces.nbytes / 2
    assert path.stat().st_size == pytest.approx(garment + body, abs=12_000)
