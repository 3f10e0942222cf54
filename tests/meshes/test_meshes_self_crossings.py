"""Crossing triangles against closed forms and against a plain second route."""

import numpy as np
import pytest

from hemline.meshes import self_crossings
from hemline.meshes.crossing_kernels import segment_crosses


def sheet(columns, rows, size=1.0):
    x, y = np.meshgrid(np.linspace(0, size, columns), np.linspace(0, size, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    first = np.stack([corner, corner + 1, corner + columns + 1], axis=1)
    second = np.stack([corner, corner + columns + 1, corner + columns], axis=1)
    return np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1), np.concatenate([first, second]).astype(np.int32)


def together(*meshes):
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [faces + start for (_, faces), start in zip(meshes, starts[:-1], strict=True)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces).astype(np.int32)


def meets(p, q, a, b, c):
    """Whether segment and triangle meet, from the solution of p + t (q - p) = a + u (b - a) + v (c - a)."""
    matrix = np.stack([p - q, b - a, c - a], axis=1)
    if abs(np.linalg.det(matrix)) < 1e-14:  # in or beside the triangle's plane
        return False
    t, u, v = np.linalg.solve(matrix, p - a)
    return 0 < t < 1 and u >= 0 and v >= 0 and u + v <= 1


def plainly(vertices, faces):
    pairs = 0
    corners = vertices[faces]
    for f in range(len(faces)):
        for g in range(f):
            if set(faces[f]) & set(faces[g]):
                continue
            sides = [(corners[f, i], corners[f, i - 2], *corners[g]) for i in range(3)]
            sides += [(corners[g, i], corners[g, i - 2], *corners[f]) for i in range(3)]
            pairs += any(meets(*side) for side in sides)
    return pairs


@pytest.mark.parametrize("seed", range(4))
def test_random_triangles_as_the_second_route_says(seed):
    rng = np.random.default_rng(seed)
    vertices = (rng.random((90, 1, 3)) + 0.2 * rng.normal(size=(90, 3, 3))).reshape(-1, 3)
    faces = np.arange(270, dtype=np.int32).reshape(90, 3)
    assert 5 < plainly(vertices, faces) == self_crossings(vertices, faces)["pairs"]


def test_a_random_mesh_with_shared_vertices():
    rng = np.random.default_rng(9)
    vertices = rng.random((40, 3)).astype(np.float32)
    faces = np.array([rng.choice(40, 3, replace=False) for _ in range(80)], np.int32)
    assert plainly(vertices.astype(np.float64), faces) == self_crossings(vertices, faces)["pairs"]


def test_flat_and_rolled_sheets_do_not_cross():
    vertices, faces = sheet(40, 30)
    assert self_crossings(vertices, faces) == {"pairs": 0, "edge_percent": 0.0}
    angle = vertices[:, 0] * 12
    spiral = np.stack([(1 + 0.05 * angle) * np.cos(angle), vertices[:, 1], (1 + 0.05 * angle) * np.sin(angle)], axis=1)
    assert self_crossings(spiral, faces)["pairs"] == 0


def test_two_sheets_that_cross_along_a_line():
    flat, faces = sheet(7, 6)
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    turned = (flat - 0.5) @ turn + [0.5, 0.5, 0.1]
    crossed = self_crossings(*together((flat, faces), (turned, faces)))
    assert 0 < crossed["pairs"] == plainly(*together((flat, faces), (turned, faces)))
    assert 0 < crossed["edge_percent"] < 30
    assert self_crossings(*together((flat, faces), (turned + [0, 0, 3.0], faces)))["pairs"] == 0


def test_an_edge_that_passes_exactly_through_an_edge_counts_with_both_triangles():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 0.0]])
    faces = np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6]], np.int32)
    assert self_crossings(vertices, faces)["pairs"] == 2


def test_the_percentage_is_that_of_edges():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, -1], [0.2, 0.2, 1], [5, 5, 0.1]])
    faces = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
    crossed = self_crossings(vertices, faces)
    assert crossed["pairs"] == 1
    through = [segment_crosses(vertices[a], vertices[b], *vertices[:3]) for a, b in ((3, 4), (4, 5), (5, 3))]
    back = [segment_crosses(vertices[a], vertices[b], *vertices[3:]) for a, b in ((0, 1), (1, 2), (2, 0))]
    assert crossed["edge_percent"] == pytest.approx(100 * (sum(through) + sum(back)) / 6)


def test_place_and_scale_do_not_matter():
    rng = np.random.default_rng(4)
    vertices = rng.random((120, 3))
    faces = np.arange(120, dtype=np.int32).reshape(40, 3)
    count = self_crossings(vertices, faces)["pairs"]
    assert count > 0
    assert self_crossings(vertices * 1e-3 - 7, faces)["pairs"] == count
    assert self_crossings(vertices * 1e3 + 50, faces)["pairs"] == count


def test_nothing_crosses_in_no_mesh():
    assert self_crossings(np.zeros((0, 3)), np.zeros((0, 3), np.int32))["pairs"] == 0
