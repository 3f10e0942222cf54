"""npz, OBJ, PC2 and MDD, read back by NumPy, trimesh, and readers from the formats' definitions."""

# trimesh.load returns one of several types
# pyright: reportAttributeAccessIssue=false

import struct
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from hemline.export import write
from hemline.meshes import read_obj


def test_npz_has_the_promised_keys(tmp_path, full_clip):
    assert write(tmp_path / "a.npz", full_clip) == (tmp_path / "a.npz",)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as arrays:
        assert sorted(arrays) == ["body_faces", "body_vertices", "faces", "fps", "notices", "vertices"]
        assert tuple(arrays["notices"]) == full_clip.notices
        np.testing.assert_array_equal(arrays["vertices"], full_clip.vertices)
        np.testing.assert_array_equal(arrays["body_vertices"], full_clip.body_vertices)
        np.testing.assert_array_equal(arrays["body_faces"], full_clip.body_faces)
        assert arrays["vertices"].dtype == np.float32
        assert arrays["faces"].dtype == np.int32
        assert float(arrays["fps"]) == 24.0


def test_npz_without_a_body(tmp_path, cloth_clip):
    write(tmp_path / "a.npz", cloth_clip)
    with np.load(tmp_path / "a.npz", allow_pickle=False) as arrays:
        assert sorted(arrays) == ["faces", "fps", "vertices"]


def test_obj_sequence_is_numbered_and_keeps_vertex_ids(tmp_path, full_clip):
    names = write(tmp_path / "a.obj", full_clip)
    assert [path.name for path in names[:2]] == ["a_0001.obj", "a_0002.obj"]
    assert [path.name for path in names[7:9]] == ["a_body_0001.obj", "a_body_0002.obj"]
    assert len(names) == 14
    for frame in (0, 3, 6):
        mesh = trimesh.load(names[frame], process=False, maintain_order=True)
        np.testing.assert_allclose(mesh.vertices, full_clip.vertices[frame], atol=1e-6)
        np.testing.assert_array_equal(mesh.faces, full_clip.faces)
        body = read_obj(names[7 + frame])
        np.testing.assert_allclose(body.vertices, full_clip.body_vertices[frame], atol=1e-6)
        np.testing.assert_array_equal(body.faces, full_clip.body_faces)
    head = names[0].read_text().splitlines()[:5]
    assert head[:4] == [
        "# hemline: metres, y up",
        "# Body: CC0 1.0",
        "# Motion: mocap.cs.cmu.edu,",
        "# NSF EIA-0196217",
    ]
    assert head[4] == "o red_cape"


def test_one_frame_is_one_obj(tmp_path, cloth_clip):
    still = replace(cloth_clip, vertices=cloth_clip.vertices[:1])
    assert write(tmp_path / "a.obj", still) == (tmp_path / "a.obj",)


def pc2(path):
    """As the format is defined: little-endian; 12 characters, version, points, start, sampling, samples, floats."""
    content = path.read_bytes()
    signature, version, points, start, rate, samples = struct.unpack_from("<12s2i2fi", content)
    assert (signature, version, start, rate) == (b"POINTCACHE2\0", 1, 0.0, 1.0)
    assert len(content) == 32 + 12 * points * samples
    return np.array(struct.unpack_from(f"<{3 * points * samples}f", content, 32)).reshape(samples, points, 3)


def mdd(path):
    """As the format is defined: big-endian; frames, points, times, floats."""
    content = path.read_bytes()
    frames, points = struct.unpack_from(">2i", content)
    times = np.array(struct.unpack_from(f">{frames}f", content, 8))
    assert len(content) == 8 + 4 * frames + 12 * points * frames
    values = struct.unpack_from(f">{3 * points * frames}f", content, 8 + 4 * frames)
    return times, np.array(values).reshape(frames, points, 3)


@pytest.mark.parametrize("ending", [".pc2", ".mdd"])
def test_point_caches_lie_beside_their_meshes(tmp_path, full_clip, ending):
    names = write(tmp_path / f"a{ending}", full_clip)
    assert [path.name for path in names] == [f"a{ending}", "a.obj", f"a_body{ending}", "a_body.obj"]
    for cache, mesh, part in zip(names[::2], names[1::2], full_clip.parts, strict=True):
        if ending == ".pc2":
            positions = pc2(cache)
        else:
            times, positions = mdd(cache)
            np.testing.assert_allclose(times, np.arange(7) / 24, atol=1e-6)
        np.testing.assert_array_equal(positions.astype(np.float32), part.vertices)
        first = trimesh.load(mesh, process=False, maintain_order=True)
        np.testing.assert_allclose(first.vertices, part.vertices[0], atol=1e-6)
        np.testing.assert_array_equal(first.faces, part.faces)
