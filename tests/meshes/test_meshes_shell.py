"""A shell around open, torn and many triangles; its kernels beside plain NumPy."""

import numpy as np
import pytest
import trimesh

from hemline.errors import BadMesh
from hemline.meshes import boundary_loops, components, shell
from hemline.meshes.shell_kernels import count_crossings, solid_angle, wind_about


def ball(radius=0.3, at=(0.0, 0.0, 0.0)):
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return np.array(mesh.vertices) + at, np.array(mesh.faces, np.int32)


def volume(vertices, faces):
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def closed(made):
    return boundary_loops(made.faces) == () and components(made.faces, len(made.vertices)).max() == 0


def test_a_closed_ball_keeps_its_place_and_volume():
    vertices, faces = ball()
    made = shell(vertices, faces, 0.02)
    assert closed(made)
    assert volume(made.vertices, made.faces) == pytest.approx(volume(vertices, faces), rel=0.01)
    assert np.abs(np.linalg.norm(made.vertices, axis=1) - 0.3).max() < 0.004
    points = np.einsum("vk,vkc->vc", made.weights, vertices[faces[made.sources]])
    assert np.linalg.norm(points - made.vertices, axis=1).max() < 0.004
    edges = np.sort(made.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_a_missing_belt_is_bridged():
    """Where rays along two of three axes see nothing."""
    vertices, faces = ball()
    kept = faces[np.abs(vertices[faces].mean(axis=1)[:, 1]) > 0.04]
    made = shell(vertices, kept, 0.02)
    assert closed(made)
    assert volume(made.vertices, made.faces) == pytest.approx(volume(vertices, faces), rel=0.06)


def test_parts_that_overlap_become_one_and_those_apart_go():
    vertices, faces = zip(ball(), ball(at=(0.3, 0, 0)), ball(0.1, (2, 0, 0)), ball(0.1), strict=True)
    first = np.cumsum([0] + [len(each) for each in vertices])
    made = shell(np.concatenate(vertices), np.concatenate([f + k for f, k in zip(faces, first, strict=False)]), 0.02)
    assert closed(made)
    assert made.vertices[:, 0].max() < 0.61  # without the ball that is apart, and without the one within


def test_what_encloses_nothing_or_too_much_is_refused():
    sheet = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.int32)
    with pytest.raises(BadMesh, match="triangles enclose nothing; got 1 triangles"):
        shell(*sheet, 0.1)
    vertices, faces = ball(radius=300.0)
    with pytest.raises(BadMesh, match="a mesh is too large to be closed; got 600 m"):
        shell(vertices, faces, 0.01)


def test_kernels_beside_numpy():
    vertices, faces = ball()
    corners, random = vertices[faces], np.random.default_rng(0)
    points = random.normal(scale=0.3, size=(50, 3))
    a, b, c = (corners[:, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(each, axis=-1) for each in (a, b, c))
    rest = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    angles = 2 * np.arctan2((a * np.cross(b, c)).sum(-1), rest)
    assert solid_angle(points[0], corners[3]) == pytest.approx(angles[0, 3], abs=1e-12)
    truth = angles.sum(axis=1) / (4 * np.pi)
    assert np.abs(truth - (np.linalg.norm(points, axis=1) < 0.3)).max() < 0.01
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    starts = np.arange(0, len(corners) + 1, 16)
    group = np.repeat(np.arange(len(starts) - 1), 16)
    centres = np.array([corners[group == k].reshape(-1, 3).mean(axis=0) for k in range(len(starts) - 1)])
    radii = np.array([np.linalg.norm(corners[group == k] - centres[k], axis=2).max() for k in range(len(starts) - 1)])
    sums = np.array([areas[group == k].sum(axis=0) for k in range(len(starts) - 1)])
    winding = np.empty(len(points))
    wind_about(points, corners, starts, centres, radii, sums, 1e9, winding)
    assert np.abs(winding - truth).max() < 1e-12
    wind_about(points, corners, starts, centres, radii, sums, 3.0, winding)
    assert np.abs(winding - truth).max() < 0.02


@pytest.mark.parametrize("along", [0, 1, 2])
def test_crossings_beside_numpy(along):
    vertices, faces = ball()
    first, second = (along + 1) % 3, (along + 2) % 3
    low, spacing, count = np.full(3, -0.4137), 0.05, 18
    found = np.zeros((count, count, count + 1), np.int32)
    count_crossings(vertices[faces], first, second, along, low, spacing, found)
    within = np.cumsum(found, axis=2)[..., :-1]
    grid = low[0] + spacing * np.stack(np.meshgrid(*[np.arange(count)] * 3, indexing="ij"), -1)
    distance = np.linalg.norm(grid, axis=-1)
    sure = np.abs(distance - 0.3) > 0.005
    assert np.array_equal(within[sure], (distance < 0.3)[sure])
