"""Seams closed, triangles cut in four."""

import igl
import numpy as np
import pytest

from hemline.meshes import ReadMesh, boundary_loops, components, subdivide, weld


def grid(count, width=1.0):
    """A square sheet in the plane y = 0."""
    line = np.linspace(0, width, count)
    x, z = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x, 0 * x, z], axis=-1).reshape(-1, 3)
    index = np.arange(count * count).reshape(count, count)
    a, b, c, d = (each.ravel() for each in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    return vertices, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)


def two_sheets(gap):
    """Two sheets side by side, so far apart; their vertices along the seam stand twice."""
    vertices, faces = grid(5)
    both = np.concatenate([vertices, vertices + (1 + gap, 0, 0)])
    return ReadMesh(
        both, np.concatenate([faces, faces + 25]).astype(np.int32), np.zeros((1, 2)), 0 * np.tile(faces, (2, 1))
    )


def test_a_seam_whose_vertices_stand_twice_is_closed():
    mesh = weld(two_sheets(0.0))
    assert len(mesh.vertices) == 45 and len(np.unique(components(mesh.faces, 45))) == 1
    assert [len(loop) for loop in boundary_loops(mesh.faces)] == [24]
    assert mesh.notes == ("seams: 5 vertices that lay on another one were welded to it, vertex ids are new",)
    # corner by corner the triangles are where they were, and the pattern is untouched
    assert np.array_equal(mesh.vertices[mesh.faces], two_sheets(0.0).vertices[two_sheets(0.0).faces])
    assert mesh.pattern_faces is not None and len(mesh.pattern_faces) == len(mesh.faces)


def test_a_seam_is_closed_whichever_way_triangles_are_wound():
    mesh = two_sheets(0.0)
    turned = mesh.faces.copy()
    turned[::3] = turned[::3, ::-1]
    assert len(weld(ReadMesh(mesh.vertices, turned)).vertices) == 45


def test_sheets_that_do_not_touch_stay_apart():
    mesh = two_sheets(1e-3)
    assert weld(mesh) is mesh


def test_a_third_sheet_at_a_seam_is_not_welded():
    vertices, faces = grid(3)
    upright = vertices[:, [1, 0, 2]]
    three = np.concatenate([vertices, vertices * (-1, 1, 1), upright])
    mesh = ReadMesh(three, np.concatenate([faces, faces[:, ::-1] + 9, faces + 18]).astype(np.int32))
    assert weld(mesh) is mesh


def test_the_inside_of_a_sheet_is_never_welded():
    vertices, faces = grid(4)
    vertices[5] = vertices[10]  # two inner vertices at one place
    mesh = ReadMesh(vertices, faces)
    assert weld(mesh) is mesh


def test_four_triangles_for_one_as_libigl_cuts_them():
    vertices, faces = grid(4)
    finer, ends = subdivide(faces, len(vertices))
    placed = np.concatenate([vertices, vertices[ends].mean(axis=1)])
    theirs, their_faces = igl.upsample(vertices, faces.astype(np.int64))[:2]
    ours = {tuple(sorted(map(tuple, corner.round(6)))) for corner in placed[finer]}
    assert ours == {tuple(sorted(map(tuple, corner.round(6)))) for corner in theirs[their_faces]}
    normals = np.cross(placed[finer[:, 1]] - placed[finer[:, 0]], placed[finer[:, 2]] - placed[finer[:, 0]])
    assert normals[:, 1] == pytest.approx(np.full(len(finer), normals[0, 1])) and len(placed) == 16 + 33
