"""A dressed character: the meshes, materials and bones of its own file, animated, with a garment."""

import copy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadInput
from hemline.export.clip import Clip
from hemline.files import atomic_write
from hemline.files.gltf import Gltf
from hemline.files.gltf_nodes import Nodes, decompose

from .glb import glb_document
from .glb_buffer import Buffer
from .glb_document import pack_glb

_DROPPED = ("VRM", "VRMC_vrm", "VRMC_springBone", "VRMC_springBone_extended_collider", "VRMC_node_constraint")
"""Extensions with which an engine would move the bones a second time."""


@dataclass(frozen=True, eq=False)
class OwnMesh:
    """The file of a character, with the joint of the body that each of its nodes follows.

    Attributes:
        gltf: The file.
        nodes: Tree of its nodes.
        rest: Transform of each node to the world of the file, where the skins were bound.
        to_body: Transform from the world of the file to the body at rest [m].
        owners: The joint that each node follows; -1: the node stands still.
    """

    gltf: Gltf
    nodes: Nodes
    rest: Float[np.ndarray, "nodes 4 4"]
    to_body: Float[np.ndarray, "4 4"]
    owners: Int[np.ndarray, " nodes"]


def write_dressed(path: Path, clip: Clip, own: OwnMesh, *, quantized: bool = False) -> tuple[Path, ...]:
    """Writes the meshes of a character and a garment, animated, as GLB.

    Animations of the character, and springs and constraints of VRM, are dropped. Bones without a joint follow the bone
    above rigidly.

    Args:
        path: The file to write.
        clip: The garment, with the skeleton of the body that was made from the character.
        own: The character.
        quantized: Whether to use fewer bytes per number for the garment.

    Raises:
        BadInput: The clip has no skeleton.
        BadOutput: The path cannot be written.
    """
    content = character_bytes(clip, own, quantized=quantized)
    with atomic_write(path) as temporary:
        temporary.write_bytes(content)
    return (path,)


def character_bytes(clip: Clip, own: OwnMesh, *, quantized: bool = False) -> bytes:
    """Returns the bytes that `write_dressed` writes."""
    if clip.skeleton is None:
        cure = "play it on the body that was made of the character"
        raise BadInput("a character's own mesh follows the skeleton of its body", "a clip without one", cure)
    garment, buffer = glb_document(
        replace(clip, body_vertices=None, body_faces=None, skeleton=None), quantized=quantized
    )
    with own.gltf.readable():
        document, content = _without_motion(own.gltf)
        _at_rest(document, own)
        tracks = _tracks(own, clip.skeleton.transforms)
    _append(document, garment | buffer.entries(), len(content))
    moved = Buffer()
    animation = _animation(moved, tracks, clip)
    added = buffer.content()
    _append(document, {"animations": [animation]} | moved.entries(), len(content) + len(added))
    content += added + moved.content()
    document["animations"] = [_merge_animations(document["animations"])]
    document["buffers"] = [{"byteLength": len(content)}]
    return pack_glb(document, content)


def _without_motion(gltf: Gltf) -> tuple[dict[str, Any], bytes]:
    """Returns the document without animations and springs, and all buffers and images as one."""
    document = copy.deepcopy(gltf.document)
    document.pop("animations", None)
    document["extensions"] = {k: v for k, v in document.get("extensions", {}).items() if k not in _DROPPED}
    for key in ("extensionsUsed", "extensionsRequired"):
        document[key] = [name for name in document.get(key, []) if name not in _DROPPED]
    for node in document["nodes"]:
        node["extensions"] = {k: v for k, v in node.get("extensions", {}).items() if k not in _DROPPED}
        if not node["extensions"]:
            del node["extensions"]
    for key in ("extensions", "extensionsUsed", "extensionsRequired"):
        if not document[key]:
            del document[key]
    starts, content = [], b""
    for each in gltf.buffers:
        starts.append(len(content))
        content += each + b"\0" * (-len(each) % 4)
    for view in document.get("bufferViews", []):
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    for image in document.get("images", []):
        content = _embed_image(gltf, document, image, content)
    return document, content


def _embed_image(gltf: Gltf, document: dict, image: dict, content: bytes) -> bytes:
    """Appends an image in a separate file to the content, and returns the content."""
    if "uri" not in image or image["uri"].startswith("data:"):
        return content
    content_of_image = gltf.beside(image.pop("uri"))
    image["mimeType"] = "image/png" if content_of_image[:4] == b"\x89PNG" else "image/jpeg"
    image["bufferView"] = len(document.setdefault("bufferViews", []))
    document["bufferViews"].append({"buffer": 0, "byteOffset": len(content), "byteLength": len(content_of_image)})
    return content + content_of_image + b"\0" * (-len(content_of_image) % 4)


def _at_rest(document: dict, own: OwnMesh) -> None:
    """Puts bones where the skins were bound, below a node that takes the world of the file to that of the body."""
    parents = own.nodes.parents
    for node in np.flatnonzero(own.owners >= 0).tolist():
        parent = parents[node]
        local = np.linalg.inv(own.rest[parent]) @ own.rest[node] if parent >= 0 else own.rest[node]
        document["nodes"][node].pop("matrix", None)
        document["nodes"][node] |= _node_transform(local)
    scene = document.get("scene", 0)
    roots = document["scenes"][scene]["nodes"] if document.get("scenes") else _roots(own)
    top = {"name": "character", "children": list(roots)} | _node_transform(own.to_body)
    document["scenes"], document["scene"] = [{"nodes": [len(document["nodes"])]}], 0
    document["nodes"].append(top)


def _roots(own: OwnMesh) -> list[int]:
    return [node for node, parent in enumerate(own.nodes.parents) if parent < 0]


def _node_transform(matrix: np.ndarray) -> dict[str, list[float]]:
    translation, rotation, scale = decompose(matrix)
    return {"translation": translation.tolist(), "rotation": rotation[[1, 2, 3, 0]].tolist(), "scale": scale.tolist()}


def _tracks(own: OwnMesh, transforms: Float[np.ndarray, "frames joints 3 4"]) -> dict[int, np.ndarray]:
    """Returns the local transform, in each frame, of each node that follows another joint than its parent."""
    skin = np.tile(np.eye(4), (*transforms.shape[:2], 1, 1))
    skin[:, :, :3] = transforms
    placed, tracks = own.to_body @ own.rest, {}
    for node in np.flatnonzero(own.owners >= 0).tolist():
        parent, owner = own.nodes.parents[node], own.owners[node]
        above = own.owners[parent] if parent >= 0 else -1
        if owner == above:
            continue
        base = own.to_body if parent < 0 else placed[parent] if above < 0 else skin[:, above] @ placed[parent]
        tracks[node] = np.linalg.inv(base) @ skin[:, owner] @ placed[node]
    return tracks


def _animation(buffer: Buffer, tracks: dict[int, np.ndarray], clip: Clip) -> dict:
    """Returns an animation of translations and rotations of nodes over the clip."""
    from scipy.spatial.transform import Rotation

    times = buffer.add((np.arange(clip.frame_count) / clip.fps).astype(np.float32), "SCALAR", bounds=True)
    animation: dict[str, Any] = {"name": "clip", "channels": [], "samplers": []}
    for node, local in tracks.items():
        scale = np.linalg.norm(local[:, :3, :3], axis=1)
        scale[:, 0] *= np.sign(np.linalg.det(local[:, :3, :3]))
        turned = Rotation.from_matrix(local[:, :3, :3] / scale[:, None]).as_quat()
        turned[1:] *= np.cumprod(np.where((turned[1:] * turned[:-1]).sum(axis=1) < 0, -1, 1))[:, None]
        for what, values, kind in (("translation", local[:, :3, 3], "VEC3"), ("rotation", turned, "VEC4")):
            output = buffer.add(values.astype(np.float32), kind)
            animation["channels"].append(
                {"sampler": len(animation["samplers"]), "target": {"node": node, "path": what}}
            )
            animation["samplers"].append({"input": times, "output": output, "interpolation": "LINEAR"})
    return animation


def _append(document: dict, other: dict, start: int) -> None:
    """Appends another document, with its indices renumbered; its buffer begins at `start`."""
    count = {
        key: len(document.get(key, [])) for key in ("accessors", "bufferViews", "meshes", "materials", "skins", "nodes")
    }
    own_nodes = bool(other.get("nodes"))

    def node(number: int) -> int:
        return number + count["nodes"] if own_nodes else number

    for view in other["bufferViews"]:
        view |= {"byteOffset": view.get("byteOffset", 0) + start}
    for accessor in other["accessors"]:
        accessor["bufferView"] += count["bufferViews"]
    for mesh in other.get("meshes", []):
        for primitive in mesh["primitives"]:
            primitive["indices"] += count["accessors"]
            primitive["material"] += count["materials"]
            for attributes in (primitive["attributes"], *primitive.get("targets", [])):
                for name in attributes:
                    attributes[name] += count["accessors"]
    for skin in other.get("skins", []):
        skin["inverseBindMatrices"] += count["accessors"]
        skin["joints"], skin["skeleton"] = [node(joint) for joint in skin["joints"]], node(skin["skeleton"])
    for each in other.get("nodes", []):
        for key, counted in (("mesh", "meshes"), ("skin", "skins")):
            if key in each:
                each[key] += count[counted]
        if "children" in each:
            each["children"] = [node(child) for child in each["children"]]
    for animation in other.get("animations", []):
        for sampler in animation["samplers"]:
            sampler["input"] += count["accessors"]
            sampler["output"] += count["accessors"]
        for channel in animation["channels"]:
            channel["target"]["node"] = node(channel["target"]["node"])
    for scene in other.get("scenes", []):
        document["scenes"][0]["nodes"] += [node(each) for each in scene["nodes"]]
    for key in (*count, "animations"):
        if other.get(key):
            document[key] = document.get(key, []) + other[key]
    for key in ("extensionsUsed", "extensionsRequired"):
        if other.get(key):
            document[key] = sorted({*document.get(key, []), *other[key]})
    notice, theirs = other.get("asset", {}).get("copyright"), document["asset"].get("copyright")
    if notice and theirs:
        document["asset"]["copyright"] = notice if theirs in notice else f"{theirs}; {notice}"
    elif notice:
        document["asset"]["copyright"] = notice


def _merge_animations(animations: list[dict]) -> dict:
    """Merges several animations into one."""
    whole: dict[str, Any] = {"name": "clip", "channels": [], "samplers": []}
    for each in animations:
        first = len(whole["samplers"])
        whole["channels"] += [channel | {"sampler": channel["sampler"] + first} for channel in each["channels"]]
        whole["samplers"] += each["samplers"]
    return whole
