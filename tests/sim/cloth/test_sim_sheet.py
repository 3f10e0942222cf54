import numpy as np
import pytest
from scipy.sparse import csr_array

from hemline.errors import BadMesh
from hemline.sim import Elastic, Stepper, make_sheet
from hemline.sim.cloth.sheet import hinge_angles
from hemline.sim.solver.clusters import make_clusters
from hemline.sim.solver.layout import SLOTS_PER_LINE, make_layout


def dense_bending(sheet):
    count = sheet.vertex_count
    matrix = np.zeros((count, count))
    for rows, values in ((sheet.ring, sheet.ring_bending), (sheet.far, sheet.far_bending)):
        matrix[np.repeat(np.arange(count), np.diff(rows.starts)), rows.columns] = values
    return matrix - np.diag(matrix.sum(axis=1))


def equilateral(count, **material):
    """A rhombus of equilateral triangles with sides of one metre."""
    number = np.arange(count * count).reshape(count, count)
    i, j = (each.ravel() / (count - 1) for each in np.divmod(number, count))
    flat = np.stack([i + 0.5 * j, np.sqrt(0.75) * j], axis=1)
    a, b, c, d = number[:-1, :-1].ravel(), number[1:, :-1].ravel(), number[1:, 1:].ravel(), number[:-1, 1:].ravel()
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([b, c, d], 1)])
    rest = np.stack([flat[faces[:, 1]] - flat[faces[:, 0]], flat[faces[:, 2]] - flat[faces[:, 0]]], axis=2)
    return flat, make_sheet(faces, rest, Elastic(**material))


def test_mass_is_density_times_area(square):
    sheet, _ = square(7, 0.8, density=0.2)
    assert sheet.mass.sum() == pytest.approx(0.2 * 0.64, rel=1e-12)


def test_edges_and_rings_agree(square):
    sheet, _ = square(5)
    rows = np.repeat(np.arange(sheet.vertex_count), np.diff(sheet.ring.starts))
    for (i, j), (ij, ji) in zip(sheet.edges, sheet.edge_slots, strict=True):
        assert (rows[ij], sheet.ring.columns[ij]) == (i, j)
        assert (rows[ji], sheet.ring.columns[ji]) == (j, i)
    # every corner pair of every face is listed once
    assert np.array_equal(np.sort(sheet.edge_corners.columns // 9), np.repeat(np.arange(len(sheet.faces)), 3))


def test_flat_sheets_do_not_bend_whatever_affine_map_moves_them(square):
    sheet, positions = square(6, bending=1.0)
    matrix = dense_bending(sheet)
    assert np.allclose(matrix, matrix.T, atol=1e-12)
    assert np.abs(matrix @ positions).max() < 1e-9
    assert np.linalg.eigvalsh(matrix).min() > -1e-9


@pytest.mark.parametrize("direction_deg", [0, 30, 45, 90])
def test_a_cylinder_costs_half_bending_times_area_over_radius_squared(direction_deg):
    # plate theory: E = 1/2 D A / R^2, on equilateral triangles in every direction. Boundary edges carry no hinge, so
    # a rim of about one cell (1/40) costs nothing: 5 %
    flat, sheet = equilateral(41, bending=2e-3)
    radius, turn = 0.5, np.radians(direction_deg)
    along = flat @ [np.cos(turn), np.sin(turn)]
    across = flat @ [-np.sin(turn), np.cos(turn)]
    rolled = np.stack([radius * np.sin(along / radius), radius * np.cos(along / radius), across], axis=1)
    energy = 0.5 * np.einsum("vi,vw,wi->", rolled, dense_bending(sheet), rolled)
    assert energy == pytest.approx(0.5 * 2e-3 * sheet.area.sum() / radius**2, rel=0.05)


@pytest.mark.parametrize("angle", [-2.5, -0.7, 0.0, 0.3, 3.0])
def test_hinge_angles_of_a_folded_pair(angle):
    # k lies at +z; l at -z when flat: turned up (+y) by the angle about the edge along x
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.3, 0, 1], [0.4, -np.sin(angle), -np.cos(angle)]])
    found = hinge_angles(vertices, np.array([[0, 1, 2, 3]]))
    assert abs(found[0]) == pytest.approx(abs(angle), abs=1e-12)
    mirrored = hinge_angles(vertices * [1, -1, 1], np.array([[0, 1, 2, 3]]))
    assert mirrored[0] == pytest.approx(-found[0], abs=1e-12)


def test_a_curved_rest_shape_is_at_rest(square):
    sheet, positions = square(8, curved=0.2, bending=1e-2, young=1e-6)
    stepper = Stepper(sheet)
    assert stepper.energy(positions) < 1e-8
    flat, _ = square(8, bending=1e-2, young=1e-6)
    assert Stepper(flat).energy(positions) > 1e-3


def test_clusters_partition_the_free_vertices(square):
    sheet, _ = square(30)
    fixed = np.zeros(sheet.vertex_count, bool)
    fixed[:30] = True
    clusters = make_clusters(sheet, fixed)
    assert np.array_equal(np.sort(clusters.members.columns), np.flatnonzero(~fixed))
    numbers = np.repeat(np.arange(len(clusters.members.starts) - 1), np.diff(clusters.members.starts))
    assert np.array_equal(clusters.label[clusters.members.columns], numbers)
    pairs = clusters.label[sheet.edges[~fixed[sheet.edges].any(axis=1)]].astype(int)
    assert 3 * (np.abs(pairs[:, 0] - pairs[:, 1]).max() + 1) <= clusters.width


def test_the_solver_keeps_the_sheets_matrix_in_its_own_order(square):
    sheet, _ = square(30, bending=1e-3)
    fixed = np.zeros(sheet.vertex_count, bool)
    fixed[:31] = True
    layout = make_layout(sheet, fixed)
    slot = layout.slot.astype(int)
    assert len(np.unique(slot)) == sheet.vertex_count and np.array_equal(layout.vertex[slot], np.arange(len(slot)))
    # each cluster is one stretch of slots from a cache line's start; fixed vertices are behind all of them
    assert not (layout.begin % SLOTS_PER_LINE).any() and (layout.end[:-1] <= layout.begin[1:]).all()
    held = np.concatenate([np.arange(*ends) for ends in zip(layout.begin, layout.end, strict=True)])
    assert np.array_equal(np.sort(layout.vertex[held]), np.flatnonzero(~fixed))
    assert slot[fixed].min() >= layout.end.max() and (layout.cluster[slot[fixed]] == len(layout.begin)).all()
    for own, laid, values, laid_values in (
        (sheet.ring, layout.ring, sheet.ring_bending, layout.ring_bending),
        (sheet.far, layout.far, sheet.far_bending, layout.far_bending),
    ):
        count = len(layout.vertex)
        there = csr_array((laid_values, laid.columns, laid.starts), shape=(count, count)).toarray()
        here = csr_array((values, own.columns, own.starts), shape=(len(slot), len(slot))).toarray()
        assert np.allclose(there[np.ix_(slot, slot)], here, rtol=1e-6)
    rows = np.repeat(np.arange(len(layout.vertex)), np.diff(layout.ring.starts.astype(int)))
    assert np.array_equal(rows[layout.edge_slots[:, 0]], slot[sheet.edges[:, 0]])
    assert np.array_equal(layout.ring.columns[layout.edge_slots[:, 0]], slot[sheet.edges[:, 1]])
    assert np.array_equal(rows[layout.edge_slots[:, 1]], slot[sheet.edges[:, 1]])


def test_a_triangle_without_area_is_refused():
    with pytest.raises(BadMesh, match="rest triangle 0 must have an area; got 1 without one; remove"):
        make_sheet(np.array([[0, 1, 2]]), np.ones((1, 2, 2)), Elastic())


def test_a_vertex_without_a_triangle_is_refused():
    with pytest.raises(BadMesh, match="vertex 2 must belong to a triangle; got none; drop"):
        make_sheet(np.array([[0, 1, 3]]), np.eye(2)[None], Elastic())
