"""Vertex-animation textures: the frames of a garment as pictures for a vertex shader."""

import json
from importlib import resources
from pathlib import Path

import numpy as np

from hemline.arrays import FramesOfVertices, UInt
from hemline.errors import BadInput
from hemline.export.glb.glb import still_bytes
from hemline.files import atomic_writes
from hemline.version import VERSION

from .clip import Clip
from .shading import unit_normals

LARGEST_TEXTURE = 8192
"""Side of the largest texture that common graphics hardware supports [pixels]."""
_WIDTHS = (256, 512, 1024, 2048, 4096, LARGEST_TEXTURE)
_SHADERS = {".shader": "unity.shader", ".gdshader": "godot.gdshader", ".hlsl": "unreal.hlsl", ".glsl": "three.glsl"}
"""Ending of each shader beside the textures, and the file that holds its text."""
_LARGEST_NUMBER = 0xFFFF


def write_textures(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Writes the garment for engines that animate it in a vertex shader.

    For `NAME.vat`: `NAME.json` (sizes, bounds, fps), `NAME_positions.png`, `NAME_normals.png`, `NAME.glb` (the first
    frame, with the pixel of each vertex as `TEXCOORD_1`) and a shader each for Unity, Godot, Unreal and three.js.
    Positions are 16-bit numbers relative to the centre of the vertices of each frame; the path of the centre is in two
    more pixels of each frame. High bytes are in the upper half of the picture and low bytes in the lower, since all
    engines and browsers read 8 bits per channel unchanged. The body is not written.

    Returns:
        The files written.

    Raises:
        BadInput: The frames do not fit in the largest texture.
        BadOutput: The path cannot be written.
    """
    from PIL import Image

    part = clip.parts[0]
    layout = _Layout.of(*part.vertices.shape[:2])
    described, positions = _positions(part.vertices, layout)
    normals = np.stack([unit_normals(vertices, part.faces) for vertices in part.vertices])
    texts = {ending: resources.files("hemline.export").joinpath("shaders", name) for ending, name in _SHADERS.items()}
    names = [path.with_suffix(".json"), path.with_suffix(".glb"), *map(path.with_suffix, texts)]
    pictures = [path.with_name(f"{path.stem}_{kind}.png") for kind in ("positions", "normals")]
    head = {"format": "hemline vertex-animation textures 1", "generator": f"hemline {VERSION}", "name": clip.name}
    table_entries = head | described | {"fps": clip.fps, "notices": list(clip.notices)}
    with atomic_writes([*names, *pictures]) as (table, mesh, *rest):
        table.write_text(json.dumps(table_entries, indent=2) + "\n")
        mesh.write_bytes(still_bytes(clip, layout.places(part.vertices.shape[1])))
        for temporary, text in zip(rest, texts.values(), strict=False):
            temporary.write_text(text.read_text())
        Image.fromarray(positions).save(rest[-2], format="PNG")
        Image.fromarray(layout.image(np.rint(127.5 * normals + 127.5).astype(np.uint8))).save(rest[-1], format="PNG")
    return (*names, *pictures)


class _Layout:
    """The pixel of each vertex of each frame: row by row, each frame starting a row.

    Args:
        frames: Number of frames.
        width: Width of the picture [pixels].
        rows: Number of rows per frame.
    """

    def __init__(self, frames: int, width: int, rows: int):
        self.frames, self.width, self.rows = frames, width, rows

    @classmethod
    def of(cls, frames: int, vertices: int) -> "_Layout":
        """Returns the narrowest layout whose picture is no taller than wide."""
        for width in _WIDTHS:
            rows = -(-(vertices + 2) // width)
            if 2 * frames * rows <= width:
                return cls(frames, width, rows)
        got = f"{frames} frames of {vertices} vertices"
        cure = "cut the clip with --seconds, or play fewer vertices with --detail"
        raise BadInput(f"a texture has {LARGEST_TEXTURE} x {LARGEST_TEXTURE} places at most", got, cure)

    def image(self, numbers: UInt[np.ndarray, "frames places 3"]) -> UInt[np.ndarray, "height width 3"]:
        """Arranges numbers in a picture of three channels."""
        whole = np.zeros((self.frames, self.rows * self.width, 3), numbers.dtype)
        whole[:, : numbers.shape[1]] = numbers
        return whole.reshape(-1, self.width, 3)

    def places(self, vertices: int) -> np.ndarray:
        """Returns the pixel of each vertex in the first frame, as fractions of the width and of half the height."""
        rows, columns = np.divmod(np.arange(vertices), self.width)
        return np.stack([(columns + 0.5) / self.width, (rows + 0.5) / (self.frames * self.rows)], axis=1)


def _positions(vertices: FramesOfVertices, layout: _Layout) -> tuple[dict, np.ndarray]:
    """Returns the entries of the table about the picture, and the picture: high bytes above low bytes."""
    frames, count = vertices.shape[:2]
    path = vertices.mean(axis=1, dtype=np.float64)
    places, low, size = _numbers(vertices - path[:, None], _LARGEST_NUMBER)
    path_numbers, path_low, path_size = _numbers(path, _LARGEST_NUMBER * (_LARGEST_NUMBER + 1))
    marks = np.stack(np.divmod(path_numbers, _LARGEST_NUMBER + 1), axis=1)
    numbers = layout.image(np.concatenate([places, marks], axis=1).astype(np.uint16))
    picture = np.concatenate([numbers >> 8, numbers & 255]).astype(np.uint8)
    table = {"frames": frames, "vertices": count, "width": layout.width, "rows": layout.rows}
    bounds = {"low": low, "size": size, "path_low": path_low, "path_size": path_size}
    return table | {name: value.tolist() for name, value in bounds.items()}, picture


def _numbers(points: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns points as whole numbers from 0 to `most`, with the low end and the size of their range [m]."""
    flat = points.reshape(-1, 3)
    low, size = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-6)
    return np.rint((points - low) / size * most).astype(np.int64), low, size
