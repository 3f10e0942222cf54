"""GLB files that meshoptimizer and Draco compressed are read as if they were not."""

import json
import struct
import sys

import numpy as np
import pytest

from hemline.errors import BadMesh
from hemline.meshes import read_mesh
from tests.meshes.mesh_samples import sphere

POINTS, FACES = sphere(3)
POINTS = POINTS.astype("<f4")


def write_glb(path, document, content):
    content += b"\0" * (-len(content) % 4)
    document["buffers"][0]["byteLength"] = len(content)
    text = json.dumps({"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], **document}).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(content), b"BIN\0") + content
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def accessors(view=True):
    points = {"componentType": 5126, "type": "VEC3", "count": len(POINTS)}
    corners = {"componentType": 5125, "type": "SCALAR", "count": FACES.size}
    return [points | {"bufferView": 0}, corners | {"bufferView": 1}] if view else [points, corners]


def by_meshopt(path, *, cut=0, count=None):
    """A file as gltfpack writes it, with a buffer for other programs that is not there."""
    meshopt = pytest.importorskip("meshopt")
    count = len(POINTS) if count is None else count
    packed = [meshopt.encode_gltf_buffer(POINTS, "ATTRIBUTES")]
    packed.append(meshopt.encode_gltf_buffer(FACES.astype("<u4").reshape(-1), "TRIANGLES"))
    name, views, start = "EXT_meshopt_compression", [], 0
    for content, stride, rows, mode in ((packed[0], 12, count, "ATTRIBUTES"), (packed[1], 4, FACES.size, "TRIANGLES")):
        entry = {"buffer": 0, "byteOffset": start, "byteLength": len(content) - cut, "byteStride": stride}
        extension = {name: entry | {"count": rows, "mode": mode}}
        views.append({"buffer": 1, "byteLength": stride * rows, "extensions": extension})
        start += len(content)
    fallback = {"byteLength": sum(view["byteLength"] for view in views), "extensions": {name: {"fallback": True}}}
    document = {
        "buffers": [{}, fallback],
        "bufferViews": views,
        "accessors": accessors(),
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "extensionsUsed": [name],
        "extensionsRequired": [name],
    }
    return write_glb(path, document, b"".join(packed))


def by_draco(path):
    draco = pytest.importorskip("DracoPy")
    content = draco.encode(POINTS, FACES.astype(np.uint32), quantization_bits=16, preserve_order=True)
    name = "KHR_draco_mesh_compression"
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    primitive["extensions"] = {name: {"bufferView": 0, "attributes": {"POSITION": 0}}}
    document = {
        "buffers": [{}],
        "bufferViews": [{"buffer": 0, "byteLength": len(content)}],
        "accessors": accessors(view=False),
        "meshes": [{"primitives": [primitive]}],
        "extensionsUsed": [name],
        "extensionsRequired": [name],
    }
    return write_glb(path, document, content)


def test_meshoptimizer_gives_the_very_numbers(tmp_path):
    mesh = read_mesh(by_meshopt(tmp_path / "it.glb"))
    assert np.array_equal(mesh.vertices, POINTS)
    # it may turn the corners of a triangle in a circle
    first = mesh.faces.argmin(axis=1)
    turned = np.stack([np.take_along_axis(mesh.faces, ((first + k) % 3)[:, None], axis=1)[:, 0] for k in range(3)], 1)
    expected = np.stack(
        [np.take_along_axis(FACES, ((FACES.argmin(axis=1) + k) % 3)[:, None], axis=1)[:, 0] for k in range(3)], 1
    )
    assert np.array_equal(turned, expected)


def test_draco_gives_the_shape_to_its_own_precision(tmp_path):
    mesh = read_mesh(by_draco(tmp_path / "it.glb"))
    corners = np.sort(mesh.vertices[mesh.faces].mean(axis=1), axis=0)
    assert np.allclose(corners, np.sort(POINTS[FACES].mean(axis=1), axis=0), atol=1e-4)


@pytest.mark.parametrize(("writer", "module"), [(by_meshopt, "meshopt"), (by_draco, "DracoPy")])
def test_without_the_decoder_the_cure_names_the_extra(tmp_path, monkeypatch, writer, module):
    path = writer(tmp_path / "it.glb")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(BadMesh, match=r"is compressed; got .*; run: pip install 'hemline\[compressed\]'"):
        read_mesh(path)


def test_what_cannot_be_decoded_or_becomes_far_too_large_is_refused(tmp_path):
    with pytest.raises(BadMesh, match="is damaged; got a part of"):
        read_mesh(by_meshopt(tmp_path / "cut.glb", cut=40))
    with pytest.raises(BadMesh, match="becomes too large when it is decompressed"):
        read_mesh(by_meshopt(tmp_path / "bomb.glb", count=2**27))
