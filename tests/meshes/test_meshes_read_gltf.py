"""GLB and glTF meshes as our own reader sees them, with trimesh as the judge of scenes."""

import base64
import json

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree

from hemline.errors import BadMesh
from hemline.meshes import read_mesh
from hemline.meshes.reading.read_gltf import read_gltf_mesh

POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5], [0, 2, 0], [9, 9, 9]], "<f4")
FACES = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]], "<u2")


def write(folder, primitives, *, nodes=({"mesh": 0},), **more):
    """A file of one mesh whose accessors are 0: points, 1: triangles, 2: a strip or fan."""
    strip = np.array([0, 1, 2, 3, 4], "<u2")
    content = POINTS.tobytes() + FACES.tobytes() + b"\0\0" + strip.tobytes()
    document = {
        "asset": {"version": "2.0"},
        "nodes": list(nodes),
        "meshes": [{"primitives": primitives}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": len(POINTS)},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": FACES.size},
            {"bufferView": 2, "componentType": 5123, "type": "SCALAR", "count": len(strip)},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 72},
            {"buffer": 0, "byteOffset": 72, "byteLength": 18},
            {"buffer": 0, "byteOffset": 92, "byteLength": 10},
        ],
        "buffers": [
            {
                "byteLength": len(content),
                "uri": "data:application/octet-stream;base64," + base64.b64encode(content).decode(),
            }
        ],
    }
    path = folder / "it.gltf"
    path.write_text(json.dumps(document | more))
    return path


PLAIN = {"attributes": {"POSITION": 0}, "indices": 1}


def test_vertices_keep_their_order_and_numbers_used_or_not(tmp_path):
    mesh = read_mesh(write(tmp_path, [PLAIN]))
    assert np.array_equal(mesh.vertices, POINTS) and mesh.vertices.dtype == np.float64
    assert np.array_equal(mesh.faces, FACES) and mesh.faces.dtype == np.int32 and not mesh.notes


@pytest.mark.parametrize(
    ("mode", "faces"),
    [
        (4, [[0, 1, 2]]),
        (5, [[0, 1, 2], [2, 1, 3], [2, 3, 4]]),
        (6, [[0, 1, 2], [0, 2, 3], [0, 3, 4]]),
    ],
)
def test_lists_strips_and_fans(mode, faces, tmp_path):
    strip = {"attributes": {"POSITION": 0}, "indices": 2, "mode": mode}
    assert read_mesh(write(tmp_path, [strip])).faces.tolist() == faces


def test_without_indices_each_three_vertices_are_a_triangle(tmp_path):
    assert read_mesh(write(tmp_path, [{"attributes": {"POSITION": 0}}])).faces.tolist() == [[0, 1, 2], [3, 4, 5]]


def test_points_and_lines_are_left_out(tmp_path):
    lines = [{"attributes": {"POSITION": 0}, "mode": mode} for mode in (0, 1, 2, 3)]
    assert len(read_mesh(write(tmp_path, [*lines, PLAIN])).faces) == 3
    with pytest.raises(BadMesh, match="must have triangles; got none"):
        read_mesh(write(tmp_path, lines))


def test_a_mirrored_node_keeps_the_outside_outside(tmp_path):
    mesh = read_mesh(write(tmp_path, [PLAIN], nodes=[{"mesh": 0, "scale": [-1, 1, 1]}]))
    assert np.array_equal(mesh.vertices, POINTS * [-1, 1, 1])
    assert np.array_equal(mesh.faces, FACES[:, [0, 2, 1]])


def test_only_what_the_first_scene_shows_is_read(tmp_path):
    nodes = [{"mesh": 0}, {"children": [2]}, {"mesh": 0, "translation": [0, 0, 7]}]
    assert len(read_mesh(write(tmp_path, [PLAIN], nodes=nodes)).faces) == 6
    shown = write(tmp_path, [PLAIN], nodes=nodes, scenes=[{"nodes": [0]}, {"nodes": [1]}], scene=1)
    assert np.array_equal(read_mesh(shown).vertices, POINTS + [0, 0, 7])


def test_a_scene_of_turned_meshes_is_as_trimesh_has_it(tmp_path):
    random = np.random.default_rng(0)
    scene = trimesh.Scene()
    for number in range(4):
        turn = trimesh.transformations.random_rotation_matrix(random.random(3))
        turn[:3, 3] = random.normal(size=3)
        turn[:3, :3] *= 0.5 + number
        scene.add_geometry(trimesh.creation.icosphere(1), transform=turn)
    scene.export(tmp_path / "it.glb")
    ours = read_mesh(tmp_path / "it.glb")
    judge = trimesh.util.concatenate(trimesh.load(tmp_path / "it.glb", process=False).dump())
    mine, theirs = (np.asarray(mesh.vertices)[mesh.faces].reshape(-1, 9) for mesh in (ours, judge))
    assert len(mine) == len(theirs) == 320 and ours.notes == ("4 meshes of the scene were joined into one",)
    distances, found = KDTree(theirs).query(mine)
    assert distances.max() < 1e-5 and len(np.unique(found)) == 320


@pytest.mark.parametrize(
    "primitive",
    [
        {"attributes": {}},
        {"attributes": {"POSITION": 9}},
        {"attributes": {"POSITION": 1}},
        {"attributes": {"POSITION": 0}, "indices": 0},
        {"attributes": {"POSITION": 0}, "indices": -1},
        "text",
    ],
)
def test_entries_that_point_nowhere(primitive, tmp_path):
    with pytest.raises(BadMesh, match="it.gltf is damaged; got an entry that is missing"):
        read_mesh(write(tmp_path, [primitive]))


def test_a_corner_that_is_no_vertex(tmp_path):
    accessors = [
        {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4},
        {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 9},
    ]
    with pytest.raises(BadMesh, match="is damaged"):
        read_mesh(write(tmp_path, [PLAIN], accessors=accessors))


@pytest.mark.parametrize("uri", ["../../../../../../dev/zero", "/dev/zero", "file:///dev/zero", "%2e%2e/secret.bin"])
def test_no_file_is_read_that_is_not_beside_it(uri, tmp_path):
    path = write(tmp_path, [PLAIN], buffers=[{"byteLength": 102, "uri": uri}])
    with pytest.raises(BadMesh, match="names a buffer that is not beside it"):
        read_mesh(path)


def test_a_link_beside_it_that_leads_elsewhere_is_not_read(tmp_path):
    (tmp_path / "zero.bin").symlink_to("/dev/zero")
    path = write(tmp_path, [PLAIN], buffers=[{"byteLength": 102, "uri": "zero.bin"}])
    with pytest.raises(BadMesh, match="names a buffer that is not beside it"):
        read_mesh(path)


def test_a_buffer_beside_it_is_read_once(tmp_path):
    whole = json.loads(write(tmp_path, [PLAIN]).read_text())["buffers"][0]["uri"]
    (tmp_path / "it.bin").write_bytes(base64.b64decode(whole.partition(",")[2]))
    beside = {"byteLength": 102, "uri": "it.bin"}
    assert np.array_equal(read_mesh(write(tmp_path, [PLAIN], buffers=[beside])).vertices, POINTS)
    with pytest.raises(BadMesh, match="has one file, or its own end, for two buffers; got ./it.bin"):
        read_mesh(write(tmp_path, [PLAIN], buffers=[beside, beside | {"uri": "./it.bin"}]))


def test_trimesh_is_not_asked(tmp_path, monkeypatch):
    monkeypatch.setattr(trimesh, "load", None)
    assert len(read_gltf_mesh(write(tmp_path, [PLAIN])).faces) == 3


def test_a_ply_cannot_have_another_file_read(tmp_path, monkeypatch):
    """PLY may name a texture, which trimesh reads where it knows the folder."""
    (tmp_path / "picture.png").write_bytes(b"no picture")
    text = trimesh.Trimesh(POINTS, FACES, process=False).export(file_type="ply", encoding="ascii").decode()
    named = text.replace("format ascii 1.0\n", "format ascii 1.0\ncomment TextureFile picture.png\n")
    (tmp_path / "it.ply").write_text(named)
    asked = []
    monkeypatch.setattr(trimesh.resolvers.FilePathResolver, "get", lambda self, name: asked.append(name))
    trimesh.load(tmp_path / "it.ply", process=False)
    assert asked == ["picture.png"]
    asked.clear()
    assert len(read_mesh(tmp_path / "it.ply").faces) == 3 and not asked


def skinned(folder, *, group_scale, bind):
    """A skinned mesh below a group that is scaled and moved, which glTF tells readers to ignore."""
    joints, weights = np.zeros((6, 4), "u1"), np.zeros((6, 4), "<f4")
    weights[:, 0] = 1
    matrix = np.asarray(bind, "<f4").T
    parts = [POINTS.tobytes(), FACES.tobytes() + b"\0\0", joints.tobytes(), weights.tobytes(), matrix.tobytes()]
    starts = np.cumsum([0] + [len(part) for part in parts])
    content = b"".join(parts)
    kinds = [(5126, "VEC3", 6), (5123, "SCALAR", 9), (5121, "VEC4", 6), (5126, "VEC4", 6), (5126, "MAT4", 1)]
    primitive = {"attributes": {"POSITION": 0, "JOINTS_0": 2, "WEIGHTS_0": 3}, "indices": 1}
    document = {
        "asset": {"version": "2.0"},
        "nodes": [
            {"name": "Hips", "translation": [0, 1, 0]},
            {"mesh": 0, "skin": 0, "translation": [0, 5, 0]},
            {"children": [1], "scale": [group_scale] * 3},
        ],
        "skins": [{"joints": [0], "inverseBindMatrices": 4}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": [
            {"bufferView": k, "componentType": kind, "type": shape, "count": count}
            for k, (kind, shape, count) in enumerate(kinds)
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": int(starts[k]), "byteLength": len(part)} for k, part in enumerate(parts)
        ],
        "buffers": [{"byteLength": len(content), "uri": "data:;base64," + base64.b64encode(content).decode()}],
    }
    path = folder / "skinned.gltf"
    path.write_text(json.dumps(document))
    return path


@pytest.mark.parametrize("group_scale", [1, 1.25, -5])
def test_a_skin_lies_where_its_bones_were_bound_whatever_its_node_says(tmp_path, group_scale):
    # centimetres brought to metres by the bind matrix, and back to where the joint stands
    bind = np.diag([0.01, 0.01, 0.01, 1.0])
    bind[1, 3] = -1
    mesh = read_mesh(skinned(tmp_path, group_scale=group_scale, bind=bind))
    assert np.allclose(mesh.vertices, 0.01 * POINTS) and np.array_equal(mesh.faces, FACES)
    assert "skin: in the pose that it was bound in" in mesh.notes


def test_primitives_that_share_their_vertices_have_those_that_they_use(tmp_path):
    path = write(tmp_path, [PLAIN, {"attributes": {"POSITION": 0}, "indices": 2, "mode": 5}])
    mesh = read_mesh(path)
    assert len(mesh.vertices) == 10 and len(mesh.faces) == 6
    assert np.array_equal(mesh.vertices[mesh.faces[3:]], POINTS[[[0, 1, 2], [2, 1, 3], [2, 3, 4]]])


def test_parts_are_named_by_node_mesh_and_material(tmp_path):
    path = write(tmp_path, [PLAIN | {"material": 0}], nodes=[{"mesh": 0, "name": "Shirt"}], materials=[{"name": "Red"}])
    mesh = read_mesh(path)
    assert mesh.labels == (("Shirt", "", "Red"),) and mesh.face_labels.tolist() == [0, 0, 0]
