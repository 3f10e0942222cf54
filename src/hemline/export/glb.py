"""glTF 2.0 in one binary file: the garment as morph targets, the body as a skin where its skeleton is known."""

import json
import struct
from pathlib import Path

import numpy as np

from hemline.files import written_whole
from hemline.pictures import linear
from hemline.version import VERSION

from .clip import Clip, Part
from .glb_buffer import Buffer
from .glb_skin import add_skin


def write_glb(path: Path, clip: Clip) -> tuple[Path, ...]:
    """Write garment and body, animated, as GLB.

    Each frame after the first is a morph target (its difference from the first, 12 bytes a vertex) with weight 1 at
    its own time and 0 at all others; between frames positions are linear in time. A body with a skeleton is a skinned
    mesh, a hundred times smaller; its weights beyond the largest four of a vertex are in `JOINTS_1`, `WEIGHTS_1`, which
    Blender reads and some viewers drop. The format has seconds, not frames: set a scene's fps before importing.

    Raises:
        BadOutput: The path cannot be written.
    """
    content = glb_bytes(clip)
    with written_whole(path) as temporary:
        temporary.write_bytes(content)
    return (path,)


def glb_bytes(clip: Clip) -> bytes:
    """The bytes that `write_glb` writes."""
    buffer = Buffer()
    times = buffer.add((np.arange(clip.frame_count) / clip.fps).astype(np.float32), "SCALAR", bounds=True)
    document = {
        "asset": {"version": "2.0", "generator": f"hemline {VERSION}"},
        "scene": 0,
        "scenes": [{"nodes": []}],
        "nodes": [],
        "meshes": [],
        "materials": [],
        "animations": [{"name": "clip", "channels": [], "samplers": []}],
    }
    if clip.notices:
        document["asset"]["copyright"] = "; ".join(clip.notices)
    for part in clip.parts:
        document["materials"].append(_material(part))
        if part.suffix and clip.skeleton is not None:
            add_skin(document, buffer, part, clip.skeleton, times)
        else:
            _add_morph(document, buffer, part, times)
    if not document["animations"][0]["channels"]:
        del document["animations"]
    return _packed(document | buffer.described(), buffer.content())


def _add_morph(document: dict, buffer: Buffer, part: Part, times: int) -> None:
    frames = len(part.vertices)
    rest = np.asarray(part.vertices[0], np.float32)
    targets = [
        {"POSITION": buffer.add(np.asarray(vertices, np.float32) - rest, "VEC3", bounds=True)}
        for vertices in part.vertices[1:]
    ]
    primitive = {
        "attributes": {"POSITION": buffer.add(rest, "VEC3", bounds=True)},
        "indices": buffer.add_indices(part.faces),
        "material": len(document["materials"]) - 1,
    }
    mesh = {"name": part.name, "primitives": [primitive]}
    if targets:
        primitive["targets"] = targets
        mesh["extras"] = {"targetNames": [f"frame_{frame:04d}" for frame in range(1, frames)]}
        mesh["weights"] = [0.0] * (frames - 1)
    document["scenes"][0]["nodes"].append(len(document["nodes"]))
    document["nodes"].append({"name": part.name, "mesh": len(document["meshes"])})
    document["meshes"].append(mesh)
    if targets:
        weights = buffer.add(np.eye(frames, frames - 1, k=-1, dtype=np.float32).ravel(), "SCALAR")
        animation = document["animations"][0]
        node = len(document["nodes"]) - 1
        target = {"node": node, "path": "weights"}
        animation["channels"].append({"sampler": len(animation["samplers"]), "target": target})
        animation["samplers"].append({"input": times, "output": weights, "interpolation": "LINEAR"})


def _material(part: Part) -> dict:
    colour = [*linear(part.colour).tolist(), 1.0]
    surface = {"baseColorFactor": colour, "metallicFactor": 0.0, "roughnessFactor": 0.9}
    return {"name": part.name, "pbrMetallicRoughness": surface, "doubleSided": not part.suffix}


def _packed(document: dict, content: bytes) -> bytes:
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(content), b"BIN\0") + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
