"""glTF as it stands: accessors of all kinds, buffers beside and within, and every way they can lie."""

import base64
import json

import numpy as np
import pytest

from hemline.errors import BadBody
from hemline.files.gltf import read_gltf
from hemline.files.gltf_nodes import read_nodes


def written(folder, accessors, views, content, **more):
    uri = "data:application/octet-stream;base64," + base64.b64encode(content).decode()
    document = {
        "asset": {"version": "2.0"},
        "accessors": accessors,
        "bufferViews": [{"buffer": 0} | view for view in views],
        "buffers": [{"byteLength": len(content), "uri": uri}],
    }
    path = folder / "it.gltf"
    path.write_text(json.dumps(document | more))
    return read_gltf(path, error=BadBody)


def test_rows_with_gaps_shares_and_sparse_values(tmp_path):
    rows = np.arange(12, dtype="<f4").reshape(4, 3)
    shares = np.array([[255, 0, 51]], np.uint8)
    content = rows.tobytes() + shares.tobytes() + b"\0" + np.array([1, 3], "<u2").tobytes() + (-rows[:2]).tobytes()
    views = [
        {"byteLength": 48, "byteStride": 24},
        {"byteOffset": 48, "byteLength": 4},
        {"byteOffset": 52, "byteLength": 4},
        {"byteOffset": 56, "byteLength": 24},
    ]
    sparse = {"count": 2, "indices": {"bufferView": 2, "componentType": 5123}, "values": {"bufferView": 3}}
    float3 = {"componentType": 5126, "type": "VEC3"}
    gltf = written(
        tmp_path,
        [
            float3 | {"bufferView": 0, "count": 2},
            {"bufferView": 1, "componentType": 5121, "type": "VEC3", "count": 1, "normalized": True},
            float3 | {"count": 4, "sparse": sparse},
        ],
        views,
        content,
    )
    assert np.array_equal(gltf.array(0), rows[::2])
    assert np.allclose(gltf.array(1), [[1, 0, 0.2]])
    assert np.array_equal(gltf.array(2), [[0, 0, 0], [0, -1, -2], [0, 0, 0], [-3, -4, -5]])


@pytest.mark.parametrize(
    "change",
    [
        {"count": 5},
        {"count": -1},
        {"count": 1e3},
        {"bufferView": 3},
        {"bufferView": -1},
        {"byteOffset": -4},
        {"byteOffset": 40},
        {"componentType": 9},
        {"type": "VEC9"},
    ],
)
def test_an_accessor_that_points_nowhere_is_refused(change, tmp_path):
    accessor = {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 4} | change
    gltf = written(tmp_path, [accessor], [{"byteLength": 48}], bytes(48))
    with pytest.raises(BadBody, match="it.gltf is damaged; got an entry that is missing, of the wrong kind, or points"):
        gltf.array(0)


@pytest.mark.parametrize(
    ("buffer", "said"),
    [
        ({"uri": "data:;base64,!!!", "byteLength": 1}, "a buffer that is no base64"),
        ({"uri": "../secret.bin", "byteLength": 1}, "names a buffer that is not beside it; got '../secret.bin'"),
        ({"uri": "/etc/passwd", "byteLength": 1}, "names a buffer that is not beside it"),
        ({"uri": "http://example.org/a.bin", "byteLength": 1}, "names a buffer that is not beside it"),
        ({"uri": "absent.bin", "byteLength": 1}, "cannot read .*absent.bin, which it.gltf names"),
        ({"uri": "there.bin", "byteLength": 9}, "is cut off; got a buffer of 4 bytes for 9"),
        ({"uri": 3, "byteLength": 9}, "is damaged"),
    ],
)
def test_buffers_are_read_beside_the_file_and_nowhere_else(buffer, said, tmp_path):
    (tmp_path / "there.bin").write_bytes(bytes(4))
    (tmp_path / "it.gltf").write_text(json.dumps({"asset": {"version": "2.0"}, "buffers": [buffer]}))
    with pytest.raises(BadBody, match=said):
        read_gltf(tmp_path / "it.gltf", error=BadBody)


def test_nodes_are_placed_by_their_parents(tmp_path):
    half = np.sqrt(0.5)
    nodes = [
        {"name": "tip", "translation": [0, 1, 0]},
        {"children": [0], "rotation": [0, 0, half, half], "scale": [2, 2, 2], "translation": [5, 0, 0]},
        {"children": [1], "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1]},
    ]
    read = read_nodes(written(tmp_path, [], [], b"", nodes=nodes))
    assert read.names == ("tip", "node 1", "node 2") and read.parents == (1, 2, -1) and read.order == (2, 1, 0)
    assert np.allclose(read.to_world(read.locals)[0, :3, 3], [3, 0, 7])


@pytest.mark.parametrize(
    "nodes",
    [
        [{"children": [1]}, {"children": [0]}],
        [{"children": [0]}],
        [{"children": [1]}, {}, {"children": [1]}],
        [{"children": [4]}],
        [{"scale": [0, 1]}],
        [{"translation": ["a", 0, 0]}],
        [{"rotation": [0, 0, 0, 0]}],
    ],
)
def test_nodes_that_are_no_tree_are_refused(nodes, tmp_path):
    with pytest.raises(BadBody, match="is damaged"):
        read_nodes(written(tmp_path, [], [], b"", nodes=nodes))
