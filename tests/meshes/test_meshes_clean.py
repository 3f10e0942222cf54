"""Small faults of meshes from files are repaired, and said; nothing else changes."""

import numpy as np
import pytest

from hemline.meshes import ReadMesh, check_mesh, clean, close_joints, face_areas, weld
from tests.meshes.mesh_samples import grid


def sheet(rows=5, columns=5):
    vertices, faces = grid(rows, columns)
    return ReadMesh(vertices, faces)


def area(mesh):
    return float(face_areas(mesh.vertices, mesh.faces).sum())


def with_faces(mesh, extra, points=()):
    vertices = np.concatenate([mesh.vertices, np.reshape(points, (-1, 3))])
    return ReadMesh(vertices, np.concatenate([mesh.faces, extra]).astype(np.int32))


def test_a_clean_mesh_is_returned_as_it_is():
    mesh = sheet()
    assert clean(mesh) is mesh and close_joints(mesh) is mesh


@pytest.mark.parametrize(
    ("extra", "points", "said"),
    [
        ([[0, 1, 1]], [], "1 triangles without area were removed"),
        ([[0, 1, 25]], [[0.125, 0, 0]], "1 triangles without area were removed"),
        ([[0, 1, 25]], [[0, 0, 0]], "1 triangles without area were removed"),
        ([[0, 1, 25]], [[1e-6, 0, 0]], "1 triangles without area were removed"),
    ],
    ids=["line", "cap", "twin", "needle"],
)
def test_a_triangle_without_area_goes(extra, points, said):
    mesh = clean(with_faces(sheet(), extra, points))
    assert len(mesh.faces) == 32 and len(mesh.vertices) == 25 and said in mesh.notes
    assert area(mesh) == pytest.approx(1) and check_mesh(mesh.vertices, mesh.faces) == ()


def test_a_cap_between_two_triangles_splits_the_neighbour_so_that_no_hole_remains():
    # 0-1-2 is a cap: 1 lies on the side from 0 to 2, beside which the triangle 0-2-3 lies
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, -1, 0], [1, 1, 0]], float)
    faces = np.array([[0, 2, 4], [0, 1, 2], [0, 3, 1], [1, 3, 2]], np.int32)
    pattern = ReadMesh(vertices, faces, vertices[:, :2], faces)
    mesh = clean(pattern)
    assert len(mesh.faces) == 4 and area(mesh) == pytest.approx(2)
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).sum() == 4
    assert np.allclose(mesh.pattern[mesh.pattern_faces], mesh.vertices[mesh.faces][:, :, :2])


def test_doubled_sheets_become_one_whether_they_share_vertices_or_not():
    mesh = sheet()
    shared = clean(with_faces(mesh, mesh.faces[:, ::-1]))
    apart = clean(with_faces(mesh, mesh.faces[:, ::-1] + 25, mesh.vertices))
    for each in (shared, apart):
        assert np.array_equal(each.faces, mesh.faces) and len(each.vertices) == 25
        assert "32 triangles that lie on another one (double-sided cloth) were left out" in each.notes


def test_ids_of_the_file_lead_to_the_vertices_that_took_their_place():
    mesh = sheet()
    loose = ReadMesh(np.concatenate([[[9.0, 9, 9]], mesh.vertices]), (mesh.faces + 1).astype(np.int32))
    result = clean(loose)
    assert result.file_ids.tolist() == [-1, *range(25)] and "1 vertices of no triangle were left out" in result.notes


def test_a_vertex_on_an_open_side_is_joined_to_it():
    left = np.array([[0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]], float)
    right = np.array([[1, 0, 0], [2, 0, 0], [2, 2, 0], [1, 2, 0], [1, 1, 0]], float)
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 8], [5, 6, 8], [6, 7, 8]]
    mesh = weld(ReadMesh(np.concatenate([left, right]), np.array(faces, np.int32)))
    joined = close_joints(mesh)
    assert len(joined.faces) == 6 and area(joined) == pytest.approx(4)
    assert joined.notes[-1] == "1 triangles were split at vertices that lay on their edge"
    assert check_mesh(joined.vertices, joined.faces) == ()


def test_a_soup_of_triangles_that_only_nearly_meet_becomes_whole():
    mesh = sheet(9, 9)
    soup = mesh.vertices[mesh.faces].reshape(-1, 3)
    soup = soup + np.random.default_rng(1).normal(0, 2e-3 / 8, soup.shape)
    whole = weld(ReadMesh(soup, np.arange(len(soup), dtype=np.int32).reshape(-1, 3)))
    assert len(whole.vertices) == 81 and "of an edge of another one were welded" in whole.notes[-1]
