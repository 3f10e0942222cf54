"""Vertex-animation textures, decoded by NumPy and by a vertex shader in Chromium."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from hemline.errors import BadInput
from hemline.export import write
from hemline.export.textures import _Layout
from hemline.meshes import vertex_normals
from tests.export.web import three, validated


def decoded(folder, name):
    """Positions and normals by the words of `write_textures`."""
    told = json.loads((folder / f"{name}.json").read_text())
    high, low = np.split(np.asarray(Image.open(folder / f"{name}_positions.png"), np.int64), 2)
    shares = (256 * high + low).reshape(told["frames"], -1, 3) / 65535
    count = told["vertices"]
    path = np.array(told["path_low"]) + told["path_size"] * (shares[:, count] + shares[:, count + 1] / 65536)
    positions = np.array(told["low"]) + told["size"] * shares[:, :count] + path[:, None]
    normals = np.asarray(Image.open(folder / f"{name}_normals.png"), float).reshape(told["frames"], -1, 3)
    return told, positions, normals[:, :count] / 127.5 - 1


def test_pictures_hold_the_vertices_within_a_tenth_of_a_millimetre(tmp_path, far_clip):
    names = write(tmp_path / "a.vat", far_clip)
    endings = (".json", ".glb", ".shader", ".gdshader", ".hlsl", ".glsl", "_positions.png", "_normals.png")
    assert [path.name for path in names] == [f"a{ending}" for ending in endings]
    told, positions, normals = decoded(tmp_path, "a")
    assert (told["frames"], told["fps"], told["vertices"]) == (7, 24.0, far_clip.vertices.shape[1])
    np.testing.assert_allclose(positions, far_clip.vertices, atol=3e-5)
    for frame, vertices in zip(normals, far_clip.vertices, strict=True):
        np.testing.assert_allclose(frame, vertex_normals(vertices, far_clip.faces), atol=0.005)


def test_shaders_move_the_vertices_as_they_moved(tmp_path, far_clip):
    """The one for three.js, and the one for Godot, whose language is GLSL but for its head."""
    names = write(tmp_path / "a.vat", far_clip)
    said = validated(names[1])[0]  # it finds that no texture uses the coordinates
    assert (said["numErrors"], said["numWarnings"]) == (0, 0)
    times = [0, 3 / 24, 2.5 / 24]
    between = 0.5 * (far_clip.vertices[2] + far_clip.vertices[3])
    with three(tmp_path) as page:
        for shader in ("glsl", "gdshader"):
            read = page("playTextures", ".", "a", shader, times)
            for found, wanted in zip(read["positions"], (*far_clip.vertices[[0, 3]], between), strict=True):
                assert 1000 * np.linalg.norm(found - wanted, axis=1).max() < 0.1, shader
            for found, frame in zip(read["normals"], (0, 3), strict=False):
                normals = vertex_normals(far_clip.vertices[frame], far_clip.faces)
                np.testing.assert_allclose(found, normals, atol=0.01, err_msg=shader)


def test_more_than_a_texture_holds_is_refused(tmp_path, cloth_clip):
    long = replace(cloth_clip, vertices=np.tile(cloth_clip.vertices, (600, 1, 1)))
    with pytest.raises(BadInput, match=r"8192 x 8192 places at most; got 4200 frames of 99 vertices; cut the clip"):
        write(tmp_path / "a.vat", long)
    assert not list(tmp_path.iterdir())
    assert _Layout.of(301, 12690).width == 4096 and _Layout.of(4000, 99).width == 8192
