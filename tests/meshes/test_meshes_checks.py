"""What is refused as cloth, and what is only said."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hemline.errors import BadMesh
from hemline.meshes import check_mesh, consistent_winding
from tests.meshes.mesh_samples import grid, sphere


def test_a_clean_sheet_and_a_clean_ball_are_let_through_in_silence():
    assert check_mesh(*grid(5, 4, jitter=0.2)) == ()
    assert check_mesh(*sphere(2)) == ()


def broken(change):
    vertices, faces = grid(4, 4)
    return change(vertices, faces)


def with_nan(vertices, faces):
    vertices[5, 1] = np.nan
    return vertices, faces


def past_the_end(vertices, faces):
    faces[3, 1] = 16
    return vertices, faces


def with_a_line(vertices, faces):
    return vertices, np.concatenate([faces, [[0, 1, 2]]])


def with_a_fan(vertices, faces):
    return np.concatenate([vertices, [[0.2, 0.1, 1.0]]]), np.concatenate([faces, [[0, 1, 16], [1, 0, 16]]])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (with_nan, "sheet must have finite vertices; got NaN or infinity in 1 of 16, first in vertex 5"),
        (past_the_end, r"face 3 names a vertex that does not exist; got .* with 16 vertices"),
        (lambda v, f: (v, f - 1), "names a vertex that does not exist"),
        (lambda v, f: (v, f[:0]), "sheet must have faces; got none"),
        (with_a_line, "must have triangles with an area; got 1 of 19, the first is face 18"),
        (lambda v, f: (v * (1, 0, 1), f), "must have triangles with an area"),
        (with_a_fan, "at most two triangles at an edge; got .* the first between vertices 0 and"),
    ],
)
def test_refuses_what_no_cloth_can_be_made_of(change, message):
    with pytest.raises(BadMesh, match=message):
        check_mesh(*broken(change), name="sheet")


def test_size_does_not_make_a_triangle_degenerate():
    vertices, faces = grid(4, 4)
    assert check_mesh(vertices * 1e-6, faces) == () and check_mesh(vertices * 1e6, faces) == ()


def test_says_what_is_odd():
    vertices, faces = grid(3, 3)
    two = np.concatenate([vertices, vertices + (1, 0, 0), [[9, 9, 9]]]), np.concatenate([faces, faces + 9])
    turned = two[1].copy()
    turned[0] = turned[0][::-1]
    notes = check_mesh(two[0], turned)
    assert notes == (
        "1 vertices belong to no triangle, the first is 18",
        "3 vertices lie exactly on another one: the mesh is open there",
        "1 triangles are wound against their neighbours",
        "2 parts that are not connected",
    )


@given(st.sets(st.integers(0, 31), max_size=15))
def test_winding_is_mended_and_the_majority_keeps_its_side(turned):
    _, faces = grid(5, 5)
    mixed = faces.copy()
    for face in turned:
        mixed[face] = mixed[face][[0, 2, 1]]
    mended, count = consistent_winding(mixed)
    assert count == len(turned)
    np.testing.assert_array_equal(mended, faces)
