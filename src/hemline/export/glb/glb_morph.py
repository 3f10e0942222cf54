"""A mesh in a GLB document with a morph target for each frame."""

from collections.abc import Iterator

import numpy as np

from hemline.arrays import Normals, Vertices
from hemline.export.clip import ClipPart
from hemline.export.shading import unit_normals

from .glb_buffer import Buffer
from .glb_quantized import QuantizedGrid, directions, normal_differences

_HALF_OF_SHORT = 16383
"""Largest number whose differences fit in two bytes."""


def add_morph(document: dict, buffer: Buffer, part: ClipPart, times: int, *, quantized: bool) -> None:
    """Adds a mesh whose frames after the first are morph targets of positions and normals.

    If quantised, positions are relative to the centre of each frame, and the node follows the path of the centre, so
    that a clip over a long distance loses no precision.

    Args:
        document: The glTF document, changed in place.
        buffer: The buffer of the document.
        part: The mesh.
        times: Accessor of the times of frames.
        quantized: Whether to use two bytes per number for positions and one for normals.
    """
    frames = len(part.vertices)
    node = {"name": part.name, "mesh": len(document["meshes"])}
    path = part.vertices.mean(axis=1, dtype=np.float64).astype(np.float32) if quantized else None
    if path is None:
        first, *targets = _floats(buffer, part)
    else:
        grid = QuantizedGrid.around(part.vertices - path[:, None], _HALF_OF_SHORT)
        path += grid.middle.astype(np.float32)
        node |= {"translation": path[0].tolist(), "scale": [grid.scale] * 3}
        first, *targets = _numbers(buffer, part, grid)
    primitive = {
        "attributes": first,
        "indices": buffer.add_indices(part.faces),
        "material": len(document["materials"]) - 1,
    }
    mesh = {"name": part.name, "primitives": [primitive]}
    if targets:
        primitive["targets"] = targets
        mesh["extras"] = {"targetNames": [f"frame_{frame:04d}" for frame in range(1, frames)]}
        mesh["weights"] = [0.0] * (frames - 1)
        tracks = {"weights": buffer.add(np.eye(frames, frames - 1, k=-1, dtype=np.float32).ravel(), "SCALAR")}
        if path is not None:
            tracks["translation"] = buffer.add(path, "VEC3")
        _animate(document["animations"][0], len(document["nodes"]), tracks, times)
    document["scenes"][0]["nodes"].append(len(document["nodes"]))
    document["nodes"].append(node)
    document["meshes"].append(mesh)


def _frames(part: ClipPart) -> Iterator[tuple[Vertices, Normals]]:
    for vertices in part.vertices:
        yield np.asarray(vertices, np.float32), unit_normals(vertices, part.faces)


def _floats(buffer: Buffer, part: ClipPart) -> Iterator[dict[str, int]]:
    """Yields accessors of the first frame, then of the difference of each other frame from it."""
    (rest, normals), *others = _frames(part)
    yield {
        "POSITION": buffer.add_attribute(rest, "VEC3", bounds=True),
        "NORMAL": buffer.add_attribute(normals, "VEC3"),
    }
    for vertices, turned in others:
        yield {
            "POSITION": buffer.add_attribute(vertices - rest, "VEC3", bounds=True),
            "NORMAL": buffer.add_attribute(turned - normals, "VEC3"),
        }


def _numbers(buffer: Buffer, part: ClipPart, grid: QuantizedGrid) -> Iterator[dict[str, int]]:
    """Yields the accessors of `_floats` as whole numbers on a grid around the centre of each frame."""
    (rest, normals), *others = _frames(part)
    places, pointing = grid.numbers(_about(rest)), directions(normals)
    yield {
        "POSITION": buffer.add_attribute(places, "VEC3", bounds=True),
        "NORMAL": buffer.add_attribute(pointing, "VEC3"),
    }
    for vertices, turned in others:
        yield {
            "POSITION": buffer.add_attribute(grid.numbers(_about(vertices)) - places, "VEC3", bounds=True),
            "NORMAL": buffer.add_attribute(directions(normal_differences(normals, turned)), "VEC3"),
        }


def _about(vertices: Vertices) -> Vertices:
    return vertices - vertices.mean(axis=0, dtype=np.float64)


def _animate(animation: dict, node: int, tracks: dict[str, int], times: int) -> None:
    for path, output in tracks.items():
        target = {"node": node, "path": path}
        animation["channels"].append({"sampler": len(animation["samplers"]), "target": target})
        animation["samplers"].append({"input": times, "output": output, "interpolation": "LINEAR"})
