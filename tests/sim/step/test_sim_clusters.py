"""Cutting a mesh into compact parts."""

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order

from hemline import garments
from hemline.sim.solver.clusters import cut
from hemline.sim.step.dressed_body import make_garment_sheet


def halve_with_scipy(graph, vertices, parts):
    """The same by scipy's breadth first, half by half."""
    if parts <= 1 or len(vertices) < 2:
        return [vertices]
    inner = graph[vertices][:, vertices]
    order = sweep(inner, int(sweep(inner, 0)[-1]))
    half = len(order) * (parts // 2) // parts
    one, two = np.sort(vertices[order[:half]]), np.sort(vertices[order[half:]])
    return halve_with_scipy(graph, one, parts // 2) + halve_with_scipy(graph, two, parts - parts // 2)


def sweep(graph, start):
    seen, order = np.zeros(graph.shape[0], bool), []
    while not seen.all():
        order.append(breadth_first_order(graph, start, directed=False, return_predecessors=False))
        seen[order[-1]] = True
        start = int(np.argmin(seen))
    return np.concatenate(order)


def couplings(sheet):
    rows = ((np.ones(len(each.columns)), each.columns, each.starts) for each in (sheet.ring, sheet.far))
    one, two = (csr_array(each, shape=(sheet.vertex_count, sheet.vertex_count)) for each in rows)
    return (one + two).tocsr()


@pytest.mark.parametrize("parts", [1, 2, 3, 50, 700])
def test_cuts_are_those_of_scipys_breadth_first(parts):
    sheet = make_garment_sheet(garments.load("tshirt-light"))
    # some are left out in stripes, so that what is left falls into pieces
    vertices = np.flatnonzero(np.arange(sheet.vertex_count) // 100 % 5 != 0)
    found, expected = cut(sheet, vertices, parts), halve_with_scipy(couplings(sheet), vertices, parts)
    assert len(found) == len(expected) == parts
    for one, two in zip(found, expected, strict=True):
        np.testing.assert_array_equal(one, two)


def test_parts_are_fewer_where_there_are_fewer_vertices(square):
    sheet, _ = square(4)
    found = cut(sheet, np.array([1, 4, 5]), 8)
    assert sorted(int(each[0]) for each in found) == [1, 4, 5] and all(len(each) == 1 for each in found)
    assert [len(each) for each in cut(sheet, np.array([], int), 1)] == [0]
