"""OBJ files keep their vertex ids, whatever else is in them."""

import numpy as np
import pytest

from hemline.errors import BadMesh
from hemline.meshes import read_obj

SQUARE = """
# a square and a loose vertex
o sheet
v 0 0 0
v 1 0 0 0.5 0.5 0.5
v 9 9 9
v 1 1 0
v 0 1 0
vt 0 0
vt 2 0
vt 2 2
vt 0 2
vn 0 0 1
s off
usemtl cloth
"""


def written(folder, text):
    path = folder / "mesh.obj"
    path.write_text(text)
    return path


def test_keeps_every_vertex_in_its_order(tmp_path):
    mesh = read_obj(written(tmp_path, SQUARE + "f 1 2 4\nf 1 4 5\n"))
    assert mesh.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [9, 9, 9], [1, 1, 0], [0, 1, 0]]
    assert mesh.faces.tolist() == [[0, 1, 3], [0, 3, 4]]
    assert mesh.pattern is None and mesh.notes == ("texture coordinates were dropped: some corners have none",)


def test_returns_the_pattern_with_its_own_ids(tmp_path):
    mesh = read_obj(written(tmp_path, SQUARE + "f 1/1/1 2/2/1 4/3/1\nf 1/1 4/3 5/4\n"))
    assert mesh.pattern is not None and mesh.pattern_faces is not None
    assert mesh.pattern.tolist() == [[0, 0], [2, 0], [2, 2], [0, 2]]
    assert mesh.pattern_faces.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_cuts_polygons_into_fans_and_says_so(tmp_path):
    mesh = read_obj(written(tmp_path, SQUARE + "f 1//1 2//1 4//1 5//1\nf 1 2 3\n"))
    assert mesh.faces.tolist() == [[0, 1, 3], [0, 3, 4], [0, 1, 2]]
    assert "1 polygons of more than three corners were cut into triangles" in mesh.notes


def test_negative_indices_count_back_from_here(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 5 5\nf -4 -3 -1\n"
    assert read_obj(written(tmp_path, text)).faces.tolist() == [[0, 1, 2], [0, 1, 3]]


def test_a_line_may_go_on_behind_a_backslash(tmp_path):
    assert read_obj(written(tmp_path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 \\\n3\n")).faces.tolist() == [[0, 1, 2]]


def test_nan_is_kept_for_the_checks_to_find(tmp_path):
    mesh = read_obj(written(tmp_path, "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"))
    assert np.isnan(mesh.vertices[0, 2]) and len(mesh.vertices) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("f 1 2 3\n", "must have vertices"),
        ("v 0 0 0\n", "must have faces"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "face 0 names vertex 4; got 3 in the file"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/2\n", "names texture coordinate 2"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4 cannot be read.*counts from 1"),
        ("v 0 0 0\nf 1 -5 1\n", "line 2 cannot be read"),
        ("v 0 0\n", "line 1 cannot be read"),
        ("v 0 zero 0\n", "line 1 cannot be read; got 'v 0 zero 0'"),
        ("v 0 0 0\nv 1 0 0\nf 1 2\n", "fewer than three corners"),
    ],
)
def test_refuses_what_it_cannot_understand(tmp_path, text, message):
    with pytest.raises(BadMesh, match=message):
        read_obj(written(tmp_path, text))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(BadMesh, match="cannot read .*nowhere.obj"):
        read_obj(tmp_path / "nowhere.obj")
