"""What generated garments are made with: girths, the zero surface of a field, cuts, even triangles."""

import numpy as np
import pytest

from hemline.errors import BadGarment
from hemline.garments.generate.clip_mesh import clip_mesh
from hemline.garments.generate.even_mesh import even_mesh
from hemline.garments.generate.marching import zero_surface
from hemline.garments.generate.tapes import tapes
from hemline.meshes import boundary_loops, components, edges, face_areas, vertex_normals

RADIUS, SPACING = 0.2, 0.02


def ball(radius=RADIUS):
    """The surface of a ball around the origin, by marching."""
    line = SPACING * (np.arange(25) - 12.3)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    return zero_surface(np.sqrt(x * x + y * y + z * z) - radius, np.full(3, line[0]), SPACING)


def lengths(vertices, faces):
    start, end = edges(faces).T
    return np.linalg.norm(vertices[start] - vertices[end], axis=1)


def test_a_ball_is_closed_and_turned_outward_and_has_its_area():
    vertices, faces = ball()
    assert not boundary_loops(faces) and components(faces, len(vertices)).max() == 0
    assert len(vertices) - len(edges(faces)) + len(faces) == 2
    assert face_areas(vertices, faces).sum() == pytest.approx(4 * np.pi * RADIUS**2, rel=0.01)
    assert ((vertex_normals(vertices, faces) * vertices).sum(axis=1) > 0).all()
    assert np.abs(np.linalg.norm(vertices, axis=1) - RADIUS).max() < SPACING**2 / RADIUS


def test_at_the_faces_of_the_grid_the_surface_ends_in_them():
    line = SPACING * np.arange(13)
    x, y, z = np.meshgrid(line, line - 0.11, line - 0.11, indexing="ij")
    vertices, faces = zero_surface(np.sqrt(x * x + y * y + z * z) - 0.1, np.array([0, -0.11, -0.11]), SPACING)
    (loop,) = boundary_loops(faces)
    assert (vertices[loop, 0] == 0).all()
    assert face_areas(vertices, faces).sum() == pytest.approx(2 * np.pi * 0.1**2, rel=0.02)


def test_a_cut_ends_on_its_plane_and_keeps_the_area_of_a_cap():
    vertices, faces = ball()
    cut, left = clip_mesh(vertices, faces, vertices[:, 1] - 0.05)
    assert cut[:, 1].max() == pytest.approx(0.05)
    (loop,) = boundary_loops(left)
    assert np.allclose(cut[loop, 1], 0.05)
    assert face_areas(cut, left).sum() == pytest.approx(2 * np.pi * RADIUS * (RADIUS + 0.05), rel=0.01)
    assert ((vertex_normals(cut, left) * cut).sum(axis=1) > 0).all()


def test_an_even_mesh_has_the_edges_asked_for_and_the_same_rim():
    vertices, faces = clip_mesh(*(mesh := ball()), mesh[0][:, 1] - 0.05)
    even, triangles = even_mesh(vertices, faces, 0.05, np.zeros(len(vertices), bool))
    long = lengths(even, triangles)
    assert np.median(long) == pytest.approx(0.05, rel=0.06) and long.min() > 0.03 and long.max() < 0.08
    (loop,) = boundary_loops(triangles)
    assert np.allclose(even[loop, 1], 0.05)
    assert np.abs(np.linalg.norm(even, axis=1) - RADIUS).max() < SPACING**2 / RADIUS
    assert ((vertex_normals(even, triangles) * even).sum(axis=1) > 0).all()


def test_what_cannot_become_such_a_mesh_is_refused():
    """A ring with one rim has a handle, which no garment has."""
    line = SPACING * (np.arange(25) - 12.3)
    x, y, z = np.meshgrid(line, line, line, indexing="ij")
    vertices, faces = zero_surface(np.hypot(np.hypot(x, z) - 0.15, y) - 0.05, np.full(3, line[0]), SPACING)
    vertices, faces = clip_mesh(vertices, faces, vertices[:, 0] - 0.18)
    with pytest.raises(BadGarment, match="enough triangles.*0\\.05 m.*shorter than"):
        even_mesh(vertices, faces, 0.05, np.zeros(len(vertices), bool))


def test_the_tape_around_a_cylinder_is_its_radius():
    around = 2 * np.pi * np.arange(400) / 400
    ring = np.stack([0.1 * np.cos(around) + 0.03, 0 * around, 0.1 * np.sin(around)], axis=1)
    low, high = ring - [0, 1, 0], ring + [0, 1, 0]
    corners = np.stack([low, np.roll(low, -1, axis=0), high], axis=1)
    angles = np.array([-1.2, 0.0, 0.7])
    found = tapes(corners, np.array([0.0, 2.0]), angles)
    assert np.allclose(found[0], 0.1 + 0.03 * np.cos(angles), atol=2e-4)
    assert np.isneginf(found[1]).all()
