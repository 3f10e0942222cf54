"""Coarser meshes: what stays as it was, what is refused, and the collapse against plain NumPy."""

import numpy as np
import pytest

from hemline.errors import BadMesh
from hemline.meshes import ClosestTree, boundary_loops, coarsen, edge_lengths, edges, rest_lengths
from tests.meshes.mesh_samples import grid, sphere


def bent(vertices):
    """A flat sheet rolled about the y axis: lengths on it stay what they are."""
    x, y, _ = vertices.T
    return np.stack([np.sin(3 * x) / 3, y, np.cos(3 * x) / 3], axis=1)


def flat_edges(vertices, faces):
    """Flat triangles of a sheet in the xy plane."""
    corner = vertices[faces][:, :, :2]
    return np.stack([corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]], axis=2)


def longest_edge_costs(vertices, faces):
    """Fourth power of the longest new edge for each vertex that goes onto a neighbour in the plane, by brute force."""
    costs = {}
    for vertex, goal in np.concatenate([edges(faces), edges(faces)[:, ::-1]]).tolist():
        around = faces[(faces == vertex).any(axis=1)]
        left = np.where(around == vertex, goal, around)[(around != goal).all(axis=1)]
        corner = vertices[left][:, :, :2]
        one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
        area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
        longest = np.linalg.norm(corner - np.roll(corner, -1, axis=1), axis=2).max(axis=1)
        if (area > 0.15 * np.sqrt(3) / 2 * longest**2).all():
            ring = np.setdiff1d(around, [vertex])
            costs[vertex, goal] = np.linalg.norm(vertices[ring] - vertices[goal], axis=1).max() ** 4
    return costs


@pytest.mark.parametrize("count", [300, 100, 30])
def test_cloth_that_was_cut_flat_has_the_same_cut(count):
    """Rest triangles of the coarser, bent mesh are those of the plane: lengths to rounding, and all of the area."""
    vertices, faces = grid(30, 25, jitter=0.25)
    found = coarsen(bent(vertices), faces, count, rest_edges=flat_edges(vertices, faces))
    assert len(found.kept) == count
    ends, lengths = rest_lengths(found.faces, found.rest_edges)
    there = vertices[found.kept]
    np.testing.assert_allclose(lengths, np.linalg.norm(there[ends[:, 0]] - there[ends[:, 1]], axis=1), rtol=1e-9)
    np.testing.assert_allclose(np.linalg.det(found.rest_edges).sum() / 2, 1.0, rtol=1e-9)


def test_a_sheet_keeps_its_corners_and_its_one_rim_and_no_triangle_turns_over():
    vertices, faces = grid(30, 25, jitter=0.25)
    found = coarsen(vertices, faces, 60)
    (rim,) = boundary_loops(found.faces)
    assert {tuple(each) for each in vertices[found.kept][rim][:, :2]} >= {(0, 0), (0, 1), (1, 0), (1, 1)}
    assert set(np.unique(found.faces)) == set(range(60))
    assert (np.linalg.det(flat_edges(vertices[found.kept], found.faces)) > 0).all()
    assert len(found.kept) - len(edges(found.faces)) + len(found.faces) == 1


def test_no_triangle_becomes_thin():
    """Of the equilateral triangle on the longest edge each has 0.15 of the area or more, even where no edge counts."""
    vertices, faces = grid(30, 25, jitter=0.25)
    for evenness in (0.01, 0.0):
        found = coarsen(bent(vertices), faces, 60, rest_edges=flat_edges(vertices, faces), evenness=evenness)
        areas = np.linalg.det(found.rest_edges) / 2
        assert (areas > 0.149 * np.sqrt(3) / 4 * edge_lengths(found.rest_edges).max(axis=1) ** 2).all()


def test_a_narrow_tube_stays_a_tube():
    """Six vertices around: without looking at common neighbours its walls would be drawn together."""
    turns, along = np.meshgrid(np.arange(6) * np.pi / 3, np.linspace(0, 1, 60))
    vertices = np.stack([0.02 * np.cos(turns), along, 0.02 * np.sin(turns)], axis=-1).reshape(-1, 3)
    row, column = np.divmod(np.arange(59 * 6), 6)
    a, b = row * 6 + column, row * 6 + (column + 1) % 6
    faces = np.concatenate([np.stack([a, a + 6, b], 1), np.stack([b, a + 6, b + 6], 1)]).astype(np.int32)
    found = coarsen(vertices, faces, 20)
    ends = np.sort(np.stack([found.faces, np.roll(found.faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    assert np.unique(ends, axis=0, return_counts=True)[1].max() == 2
    assert [len(rim) >= 3 for rim in boundary_loops(found.faces)] == [True, True]
    assert len(found.kept) - len(edges(found.faces)) + len(found.faces) == 0


def test_edges_become_even():
    vertices, faces = grid(40, 40, jitter=0.3)
    found = coarsen(vertices, faces, 160)
    _, lengths = rest_lengths(found.faces, found.rest_edges)
    assert np.percentile(lengths, 95) < 2.5 * np.percentile(lengths, 5)


def test_what_is_closed_stays_closed_and_round():
    vertices, faces = sphere(4)
    found = coarsen(vertices, faces, 200, evenness=1e-4)
    assert boundary_loops(found.faces) == ()
    assert len(found.kept) - len(edges(found.faces)) + len(found.faces) == 2
    distances = ClosestTree(vertices[found.kept], found.faces).signed_distances(vertices)
    assert distances.min() + 1e-9 >= 0 and distances.max() < 0.05  # a sphere of 200 vertices has edges of 0.27


def test_the_first_to_go_is_the_cheapest_by_brute_force():
    vertices, faces = grid(7, 6, jitter=0.3, seed=2)
    found = coarsen(vertices, faces, len(vertices) - 1)
    (gone,) = np.setdiff1d(np.arange(len(vertices)), found.kept)
    (rim,) = boundary_loops(faces)
    along = {
        pair
        for one, two in zip(rim.tolist(), np.roll(rim, 1).tolist(), strict=True)
        for pair in ((one, two), (two, one))
    }
    corners = {0, 5, 36, 41}
    costs = longest_edge_costs(vertices, faces)
    costs = {each: costs[each] for each in costs if each[0] not in corners and (each[0] not in rim or each in along)}
    vertex, goal = min(costs, key=lambda pair: costs[pair])
    assert gone == vertex
    expected = np.where(faces == vertex, goal, faces)[~((faces == vertex).any(1) & (faces == goal).any(1))]
    np.testing.assert_array_equal(found.kept[found.faces], expected)


def test_levels_are_nested():
    vertices, faces = grid(30, 25, jitter=0.25)
    kept = [coarsen(vertices, faces, count).kept for count in (400, 100, 30)]
    assert set(kept[0]) > set(kept[1]) > set(kept[2])


def test_bound_vertices_stay_in_their_line():
    """A line across the sheet, bound: what is left of it still runs from side to side, and none of it has gone off."""
    vertices, faces = grid(31, 25)
    bound = (np.abs(vertices[:, 1] - 0.5) < 1e-9).astype(int)
    found = coarsen(vertices, faces, 80, bound=bound)
    line = np.flatnonzero(bound[found.kept])
    along = [pair for pair in edges(found.faces).tolist() if set(pair) <= set(line.tolist())]
    assert 2 <= len(line) < 25 and len(along) == len(line) - 1
    free = coarsen(vertices, faces, 80)
    assert bound[free.kept].sum() < len(line)


def test_too_few_are_refused():
    vertices, faces = grid(10, 10)
    with pytest.raises(BadMesh, match="a coarser mesh has 8 vertices or more; got 7; keep a larger share"):
        coarsen(vertices, faces, 7)


@pytest.mark.parametrize("seed", range(3))
def test_no_triangle_of_crumpled_cloth_is_thin_when_it_is_laid_flat(seed):
    vertices, faces = sphere(4)
    noise = np.random.default_rng(seed).normal(size=(len(vertices), 1))
    coarse = coarsen((vertices * (1 + 0.06 * noise)).astype(np.float32), faces, len(vertices) // 5)
    one, two = coarse.rest_edges[:, :, 0], coarse.rest_edges[:, :, 1]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    longest = np.linalg.norm(np.stack([one, two, two - one]), axis=2).max(axis=0)
    assert (area / (np.sqrt(3) / 2 * longest**2)).min() > 0.079


@pytest.mark.parametrize("seed", range(6))
def test_no_vertex_of_torn_cloth_is_left_without_a_triangle(seed):
    """A sheet with holes, whose lone triangles go before their tips."""
    random, side = np.random.default_rng(seed), 14
    x, z = (each.ravel() for each in np.meshgrid(np.arange(side), np.arange(side), indexing="ij"))
    vertices = np.stack([x, 0.2 * random.normal(size=side * side), z], axis=1)
    at = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    faces = np.concatenate([np.stack([at, at + 1, at + side], 1), np.stack([at + 1, at + side + 1, at + side], 1)])
    used, faces = np.unique(faces[random.random(len(faces)) > 0.3], return_inverse=True)
    coarse = coarsen(vertices[used], faces.reshape(-1, 3).astype(np.int32), 50)
    assert np.array_equal(np.unique(coarse.faces), np.arange(len(coarse.kept)))
    assert 45 <= len(coarse.kept) < 0.6 * len(used), "rims and corners may stay"
