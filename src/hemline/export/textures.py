"""Vertex-animation textures: a garment's frames as pictures that a vertex shader reads."""

import json
from importlib import resources
from pathlib import Path

import numpy as np

from hemline.arrays import FramesOfVertices, UInt
from hemline.errors import BadInput
from hemline.export.glb.glb import still_bytes
from hemline.files import written_together
from hemline.version import VERSION

from .clip import Clip
from .shading import unit_normals

LARGEST_TEXTURE = 8192
"""Side of the largest texture that common graphics hardware reads [pixels]."""
_WIDTHS = (256, 512, 1024, 2048, 4096, LARGEST_TEXTURE)
_SHADERS = {".shader": "unity.shader", ".gdshader": "godot.gdshader", ".hlsl": "unreal.hlsl", ".glsl": "three.glsl"}
"""Ending of the file beside the textures, and where its text is."""
_LARGEST_NUMBER = 0xFFFF


def write_textures(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Write the garment for engines that animate it in a vertex shader.

    For `NAME.vat`: `NAME.json` (sizes, bounds, fps), `NAME_positions.png`, `NAME_normals.png`, `NAME.glb` (the first
    frame, with `TEXCOORD_1` = each vertex's place in the textures) and a shader each for Unity, Godot, Unreal and
    three.js. Positions are 16-bit numbers, relative to the middle of each frame's vertices; the path of the middle
    stands in two more places of each frame. Each number's high byte is in the upper half of the picture and its low
    byte in the lower, since 8 bits a channel is what all engines and browsers read unchanged. The body is left out.

    Returns:
        The files written.

    Raises:
        BadInput: The clip has more frames and vertices than the largest texture.
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
    told = head | described | {"fps": clip.fps, "notices": list(clip.notices)}
    with written_together([*names, *pictures]) as (table, mesh, *rest):
        table.write_text(json.dumps(told, indent=2) + "\n")
        mesh.write_bytes(still_bytes(clip, layout.places(part.vertices.shape[1])))
        for temporary, text in zip(rest, texts.values(), strict=False):
            temporary.write_text(text.read_text())
        Image.fromarray(positions).save(rest[-2], format="PNG")
        Image.fromarray(layout.filled(np.rint(127.5 * normals + 127.5).astype(np.uint8))).save(rest[-1], format="PNG")
    return (*names, *pictures)


class _Layout:
    """Where each vertex of each frame stands: row by row, each frame beginning a row.

    Args:
        frames: How many frames.
        width: Width of the picture [pixels].
        rows: Rows of a frame.
    """

    def __init__(self, frames: int, width: int, rows: int):
        self.frames, self.width, self.rows = frames, width, rows

    @classmethod
    def of(cls, frames: int, vertices: int) -> "_Layout":
        """The narrowest whose picture is no taller than it is wide."""
        for width in _WIDTHS:
            rows = -(-(vertices + 2) // width)
            if 2 * frames * rows <= width:
                return cls(frames, width, rows)
        got = f"{frames} frames of {vertices} vertices"
        cure = "cut the clip with --seconds, or play fewer vertices with --detail"
        raise BadInput(f"a texture has {LARGEST_TEXTURE} x {LARGEST_TEXTURE} places at most", got, cure)

    def filled(self, numbers: UInt[np.ndarray, "frames places 3"]) -> UInt[np.ndarray, "height width 3"]:
        """A picture of three channels."""
        whole = np.zeros((self.frames, self.rows * self.width, 3), numbers.dtype)
        whole[:, : numbers.shape[1]] = numbers
        return whole.reshape(-1, self.width, 3)

    def places(self, vertices: int) -> np.ndarray:
        """Middle of the pixel of each vertex in the first frame, as shares of width and of one half's height."""
        rows, columns = np.divmod(np.arange(vertices), self.width)
        return np.stack([(columns + 0.5) / self.width, (rows + 0.5) / (self.frames * self.rows)], axis=1)


def _positions(vertices: FramesOfVertices, layout: _Layout) -> tuple[dict, np.ndarray]:
    """What the table says of the picture, and the picture: high bytes above low bytes."""
    frames, count = vertices.shape[:2]
    path = vertices.mean(axis=1, dtype=np.float64)
    places, low, size = _numbers(vertices - path[:, None], _LARGEST_NUMBER)
    ways, path_low, path_size = _numbers(path, _LARGEST_NUMBER * (_LARGEST_NUMBER + 1))
    marks = np.stack(np.divmod(ways, _LARGEST_NUMBER + 1), axis=1)
    numbers = layout.filled(np.concatenate([places, marks], axis=1).astype(np.uint16))
    picture = np.concatenate([numbers >> 8, numbers & 255]).astype(np.uint8)
    table = {"frames": frames, "vertices": count, "width": layout.width, "rows": layout.rows}
    bounds = {"low": low, "size": size, "path_low": path_low, "path_size": path_size}
    return table | {name: value.tolist() for name, value in bounds.items()}, picture


def _numbers(points: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Whole numbers up to `most`, and the bounds that they are shares of [m]."""
    flat = points.reshape(-1, 3)
    low, size = flat.min(axis=0), np.maximum(np.ptp(flat, axis=0), 1e-6)
    return np.rint((points - low) / size * most).astype(np.int64), low, size
