"""PLY in three encodings, with triangles and quads together, colours and marks."""

import struct

import pytest

from hemline.errors import BadMesh
from hemline.meshes import read_mesh

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 2, 0)]
POLYGONS = [[0, 1, 2, 3], [3, 2, 4]]
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def write(path, encoding, polygons=POLYGONS, ends="\n"):
    head = (
        f"ply\nformat {encoding} 1.0\ncomment made by hand\nelement vertex {len(POINTS)}\nproperty double x\n"
        "property double y\nproperty double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
        f"property float pins\nelement face {len(polygons)}\nproperty list uchar int vertex_indices\n"
        "property uchar flags\nend_header\n"
    )
    order = ORDERS[encoding]
    rows = [(*point, 255, 0, 51 * k, float(k > 2)) for k, point in enumerate(POINTS)]
    if order:
        body = b"".join(struct.pack(f"{order}3d3Bf", *row) for row in rows)
        body += b"".join(struct.pack(f"{order}B{len(each)}iB", len(each), *each, 7) for each in polygons)
    else:
        lines = [" ".join(map(str, row)) for row in rows]
        lines += [f"{len(each)} {' '.join(map(str, each))} 7" for each in polygons]
        body = ("\n".join(lines) + "\n").replace("\n", ends).encode()
    path.write_bytes(head.replace("\n", ends).encode() + body)
    return path


@pytest.mark.parametrize("encoding", ORDERS)
def test_triangles_and_quads_are_read_alike_in_each_encoding(tmp_path, encoding):
    mesh = read_mesh(write(tmp_path / "it.ply", encoding))
    assert mesh.vertices.tolist() == [list(map(float, point)) for point in POINTS]
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 2, 3], [3, 2, 4]]
    assert mesh.colours[3].tolist() == [1, 0, 0.6] and mesh.marks["pins"].tolist() == [False] * 3 + [True] * 2


def test_line_ends_of_other_systems_are_read(tmp_path):
    assert len(read_mesh(write(tmp_path / "it.ply", "ascii", ends="\r\n")).faces) == 3


@pytest.mark.parametrize("encoding", ORDERS)
def test_what_is_cut_off_is_refused(tmp_path, encoding):
    path = write(tmp_path / "it.ply", encoding)
    path.write_bytes(path.read_bytes()[:-6])
    with pytest.raises(BadMesh, match="cannot be read as .ply; got a damaged file"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("polygons", "said"), [([[0, 1, 9]], "a face names vertex 9"), ([[0, 1]], "must have triangles; got none")]
)
def test_faces_that_point_nowhere_or_are_lines_are_refused(tmp_path, polygons, said):
    with pytest.raises(BadMesh, match=said):
        read_mesh(write(tmp_path / "it.ply", "ascii", polygons))
