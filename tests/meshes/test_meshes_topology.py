"""Edges, rims, parts, areas and normals, with trimesh as the judge."""

import numpy as np
import pytest
import trimesh

from hemline.meshes import boundary_loops, components, edges, face_areas, face_normals, vertex_normals
from tests.meshes.mesh_samples import grid, sphere


def test_edges_are_those_of_trimesh():
    vertices, faces = grid(6, 5)
    judge = trimesh.Trimesh(vertices, faces, process=False).edges_unique
    np.testing.assert_array_equal(edges(faces), np.unique(np.sort(judge, axis=1), axis=0))
    assert len(vertices) - len(edges(faces)) + len(faces) == 1  # Euler: a disc


def test_a_sheet_has_one_rim_that_runs_against_its_triangles():
    vertices, faces = grid(4, 5)
    (loop,) = boundary_loops(faces)
    assert len(loop) == 2 * (4 + 5) - 4 and loop[0] == 0
    x, y, _ = vertices[loop].T
    area = 0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)
    assert area == pytest.approx(-1.0)


def test_a_tube_has_two_rims_and_a_ball_none():
    tube = trimesh.creation.cylinder(1, 2, sections=12)
    sides = np.abs(tube.face_normals[:, 2]) < 0.5
    assert [len(loop) for loop in boundary_loops(np.array(tube.faces[sides]))] == [12, 12]
    assert boundary_loops(sphere(1)[1]) == ()


def test_rims_that_touch_in_a_vertex_are_split_there():
    # two triangles that share one vertex
    loops = boundary_loops(np.array([[0, 1, 2], [2, 3, 4]]))
    assert sorted(sorted(loop.tolist()) for loop in loops) == [[0, 1, 2], [2, 3, 4]]


def test_every_rim_edge_lies_on_exactly_one_loop():
    vertices, faces = grid(9, 9)
    inner = np.abs(vertices[faces].mean(axis=1)[:, :2] - 0.5).max(axis=1) > 0.15
    loops = boundary_loops(faces[inner])
    count = trimesh.Trimesh(vertices, faces[inner], process=False)
    groups = trimesh.grouping.group_rows(count.edges_sorted, require_count=1)
    assert sum(len(loop) for loop in loops) == len(groups) and len(loops) == 2


def test_components_are_numbered_and_loose_vertices_stand_alone():
    assert components(np.array([[0, 1, 2], [4, 5, 6]]), 8).tolist() == [0, 0, 0, 1, 2, 2, 2, 3]


def test_areas_and_normals_of_a_sphere():
    vertices, faces = sphere(4)
    assert face_areas(vertices, faces).sum() == pytest.approx(4 * np.pi, rel=0.003)
    normals = vertex_normals(vertices, faces)
    assert np.abs(normals - vertices).max() < 0.01
    judge = trimesh.Trimesh(vertices, faces, process=False)
    np.testing.assert_allclose(face_normals(vertices, faces), judge.face_normals, atol=1e-12)


def test_a_vertex_normal_is_weighted_by_area():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 3.0]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])  # normals +z (area 1/2) and +x (area 3/2)
    np.testing.assert_allclose(vertex_normals(vertices, faces)[0], np.array([3, 0, 1]) / np.sqrt(10))
    assert vertex_normals(vertices.astype(np.float32), faces).dtype == np.float32


def test_degenerate_triangles_and_loose_vertices_have_normal_zero():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [5, 5, 5.0]])
    assert (vertex_normals(vertices, np.array([[0, 1, 2]])) == 0).all()
