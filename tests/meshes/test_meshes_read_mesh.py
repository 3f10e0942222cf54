"""PLY, GLB and STL, written by another library and read back."""

import numpy as np
import pytest
import trimesh

from hemline.errors import BadMesh
from hemline.meshes import read_mesh

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [7, 7, 7]], float)
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize("ending", ["ply", "glb", "obj"])
def test_keeps_vertices_and_their_order(tmp_path, ending):
    path = tmp_path / f"sheet.{ending}"
    trimesh.Trimesh(VERTICES, FACES, process=False).export(path)
    mesh = read_mesh(path)
    np.testing.assert_allclose(mesh.vertices, VERTICES, atol=1e-7)
    assert mesh.faces.tolist() == FACES.tolist() and mesh.faces.dtype == np.int32


def test_stl_is_merged_aloud(tmp_path):
    trimesh.Trimesh(VERTICES, FACES, process=False).export(tmp_path / "sheet.stl")
    mesh = read_mesh(tmp_path / "sheet.stl")
    assert len(mesh.vertices) == 4 and len(mesh.faces) == 2
    assert "STL has no shared vertices" in mesh.notes[0]
    corners = {tuple(map(tuple, mesh.vertices[face])) for face in mesh.faces}
    assert corners == {tuple(map(tuple, VERTICES[face])) for face in FACES}


def test_a_scene_of_two_meshes_becomes_one_aloud(tmp_path):
    sheets = [trimesh.Trimesh(VERTICES[:4] + shift, FACES, process=False) for shift in (0, 2)]
    trimesh.Scene(sheets).export(tmp_path / "two.glb")
    mesh = read_mesh(tmp_path / "two.glb")
    assert len(mesh.vertices) == 8 and len(mesh.faces) == 4 and mesh.faces.max() == 7
    assert mesh.notes == ("2 meshes of the scene were joined into one",)


def test_a_placed_mesh_is_read_where_it_is_placed(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(
        trimesh.Trimesh(VERTICES[:4], FACES, process=False),
        transform=trimesh.transformations.translation_matrix([0, 5, 0]),
    )
    scene.export(tmp_path / "placed.glb")
    np.testing.assert_allclose(read_mesh(tmp_path / "placed.glb").vertices, VERTICES[:4] + [0, 5, 0], atol=1e-6)


def test_refuses_unknown_endings_and_missing_files(tmp_path):
    with pytest.raises(BadMesh, match=r"no known mesh ending; got '.fbx'"):
        read_mesh(tmp_path / "a.fbx")
    with pytest.raises(BadMesh, match="got No such file"):
        read_mesh(tmp_path / "a.ply")


@pytest.mark.parametrize("ending", ["ply", "glb", "stl"])
def test_refuses_truncated_files(tmp_path, ending):
    path = tmp_path / f"sheet.{ending}"
    trimesh.Trimesh(VERTICES[:4], FACES, process=False).export(path)
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(BadMesh, match=r"sheet\."):
        read_mesh(path)


def test_refuses_a_cloud_of_points(tmp_path):
    trimesh.PointCloud(VERTICES).export(tmp_path / "points.ply")
    with pytest.raises(BadMesh, match="must have triangles"):
        read_mesh(tmp_path / "points.ply")
