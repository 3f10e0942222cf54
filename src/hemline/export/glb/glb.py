"""glTF 2.0 in one binary file: a mesh with a skeleton as a skin, one without as morph targets."""

from pathlib import Path

import numpy as np

from hemline.arrays import Float
from hemline.export.clip import Clip
from hemline.export.shading import unit_normals
from hemline.files import atomic_write

from .glb_buffer import Buffer
from .glb_document import asset, material, pack_glb
from .glb_morph import add_morph
from .glb_quantized import EXTENSION
from .glb_skin import add_skin


def write_glb(path: Path, clip: Clip, *, quantized: bool = False) -> tuple[Path, ...]:
    """Writes garment and body, animated, as GLB.

    Each frame after the first is a morph target (its difference from the first, 24 bytes a vertex, normals included)
    with weight 1 at its own time and 0 at all others; between frames positions are linear in time. A mesh with a
    skeleton is skinned and a hundred times smaller: the body if it has a skeleton, the garment if the clip has a skin.
    Weights of the body beyond the largest four per vertex are in `JOINTS_1` and `WEIGHTS_1`, which Blender reads and
    some viewers ignore. The format stores seconds, not frames: set the frame rate of a scene before importing.

    Args:
        path: The file to write.
        clip: The clip.
        quantized: Whether to use two bytes per number for positions and weights, and one for normals
            (`KHR_mesh_quantization`): half the size, within 0.1 mm for meshes of 6 m or less.

    Raises:
        BadOutput: The path cannot be written.
    """
    content = glb_bytes(clip, quantized=quantized)
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
    return (path,)


def glb_bytes(clip: Clip, *, quantized: bool = False) -> bytes:
    """Returns the bytes that `write_glb` writes."""
    document, buffer = glb_document(clip, quantized=quantized)
    return pack_glb(document | buffer.entries(), buffer.content())


def glb_document(clip: Clip, *, quantized: bool) -> tuple[dict, Buffer]:
    """Returns the document of `write_glb` without entries about buffers, and the buffer."""
    buffer = Buffer()
    times = buffer.add((np.arange(clip.frame_count) / clip.fps).astype(np.float32), "SCALAR", bounds=True)
    document = {
        "asset": asset(clip.notices),
        "scene": 0,
        "scenes": [{"nodes": []}],
        "nodes": [],
        "meshes": [],
        "materials": [],
        "animations": [{"name": "clip", "channels": [], "samplers": []}],
    }
    if quantized:
        document |= {"extensionsUsed": [EXTENSION], "extensionsRequired": [EXTENSION]}
    for part in clip.parts:
        document["materials"].append(material(part.name, part.colour, both_sides=not part.suffix))
        if part.skeleton is not None:
            add_skin(document, buffer, part, part.skeleton, times, quantized=quantized)
        else:
            add_morph(document, buffer, part, times, quantized=quantized)
    if clip.skin is not None:
        errors = {"mean_error_mm": round(clip.skin.mean_error_mm, 3), "max_error_mm": round(clip.skin.max_error_mm, 3)}
        document["meshes"][0]["extras"] = {"bones": clip.skin.bone_count} | errors
    if not document["animations"][0]["channels"]:
        del document["animations"]
    return document, buffer


def still_bytes(clip: Clip, places: Float[np.ndarray, "verts 2"]) -> bytes:
    """Returns the first frame of the garment as GLB, with texture coordinates [1] in both sets."""
    buffer, part = Buffer(), clip.parts[0]
    rest = np.asarray(part.vertices[0], np.float32)
    where = buffer.add_attribute(places.astype(np.float32), "VEC2")
    attributes = {
        "POSITION": buffer.add_attribute(rest, "VEC3", bounds=True),
        "NORMAL": buffer.add_attribute(unit_normals(rest, part.faces), "VEC3"),
        "TEXCOORD_0": where,
        "TEXCOORD_1": where,
    }
    primitive = {"attributes": attributes, "indices": buffer.add_indices(part.faces), "material": 0}
    document = {
        "asset": asset(clip.notices),
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": part.name, "mesh": 0}],
        "meshes": [{"name": part.name, "primitives": [primitive]}],
        "materials": [material(part.name, part.colour, both_sides=not part.suffix)],
    }
    return pack_glb(document | buffer.entries(), buffer.content())
