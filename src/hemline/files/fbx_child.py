"""Converts an FBX from stdin to a GLB on stdout; `hemline.files.fbx` runs it in a process of its own.

Objects of ufbx 0.0.5 may be freed while others still refer to them. So none is let go before the process ends.
"""

import json
import os
import struct
import sys
from typing import Any

import numpy as np

_KINDS = {"f4": 5126, "u2": 5123, "u4": 5125}
_NUMBERS_MAX = 100_000_000
_RATES = (5.0, 120.0)
_MOVES = 1e-7
"""A node whose transform changes by less than this is not animated."""
_WEIGHTS = 4
"""Number of weights of a vertex."""


class _Glb:
    """A GLB that grows."""

    def __init__(self) -> None:
        self.binary = bytearray()
        self.document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "hemline"}, "buffers": [{}]}

    def add(self, kind: str, entry: dict[str, Any]) -> int:
        """Adds an entry to one of the lists, and returns its number."""
        self.document.setdefault(kind, []).append(entry)
        return len(self.document[kind]) - 1

    def array(self, array: np.ndarray, shape: str) -> int:
        """Adds an accessor with its bytes, and returns its number."""
        content = np.ascontiguousarray(array).tobytes()
        view = self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)})
        self.binary += content + b"\0" * (-len(content) % 4)
        kind = _KINDS[array.dtype.str[1:]]
        return self.add("accessors", {"bufferView": view, "componentType": kind, "count": len(array), "type": shape})

    def to_bytes(self) -> bytes:
        """Returns the file."""
        self.document["buffers"][0]["byteLength"] = len(self.binary)
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        size = 12 + 8 + len(text) + 8 + len(self.binary)
        head = struct.pack("<4sII", b"glTF", 2, size) + struct.pack("<I4s", len(text), b"JSON")
        return head + text + struct.pack("<I4s", len(self.binary), b"BIN\0") + bytes(self.binary)


def convert(content: bytes) -> bytes:
    """Returns an FBX as GLB.

    Args:
        content: The FBX, binary or text.

    Raises:
        ValueError: There are far too many frames or nodes.
    """
    import ufbx

    scene = _keep(ufbx.load_memory(content, inherit_mode_handling=ufbx.InheritModeHandling.COMPENSATE))
    nodes = _all(scene.nodes)
    glb = _Glb()
    children: list[list[int]] = [[] for _ in nodes]
    roots = []
    for number, node in enumerate(nodes):
        parent = _keep(node.parent)
        (roots if parent is None else children[parent.typed_id]).append(number)
    for number, node in enumerate(nodes):
        turn = node.local_transform
        entry: dict[str, Any] = {
            "name": node.name or "root",
            "translation": list(turn.translation),
            "rotation": list(turn.rotation),
            "scale": list(turn.scale),
        }
        glb.add("nodes", entry | ({"children": children[number]} if children[number] else {}))
    glb.document |= {"scene": 0, "scenes": [{"nodes": roots}]}
    _add_meshes(glb, scene, nodes)
    _add_animations(glb, ufbx, scene, nodes)
    return glb.to_bytes()


_KEPT: list[Any] = []


def _keep(thing: Any) -> Any:
    """Returns an object of the library, which lives until the process ends."""
    _KEPT.append(thing)
    return thing


def _all(objects: Any) -> list[Any]:
    """Returns the objects of a list of the library."""
    _keep(objects)
    return [_keep(objects[number]) for number in range(len(objects))]


def _add_meshes(glb: _Glb, scene: Any, nodes: list[Any]) -> None:
    for mesh in _all(scene.meshes):
        if not mesh.num_triangles:
            continue
        points = np.array(_keep(mesh.vertices), dtype=np.float64).reshape(-1, 3)
        skins = _all(mesh.skin_deformers)
        clusters = _all(skins[0].clusters) if skins else []
        faces = glb.array(_triangles(mesh).astype("<u4"), "SCALAR")
        for node in _all(mesh.instances):
            number, placed = node.typed_id, points
            if not clusters:
                place = np.array(nodes[number].geometry_to_node, dtype=np.float64)
                placed = points @ place[:3] + place[3]
            attributes = {"POSITION": glb.array(placed.astype("<f4"), "VEC3")}
            if clusters:
                glb.document["nodes"][number]["skin"] = _add_skin(glb, clusters, len(points), attributes)
            primitive = {"attributes": attributes, "indices": faces}
            name = nodes[number].name or "mesh"
            glb.document["nodes"][number]["mesh"] = glb.add("meshes", {"name": name, "primitives": [primitive]})


def _triangles(mesh: Any) -> np.ndarray:
    """Returns the corners of all triangles, in one row; polygons are cut into fans."""
    corners = np.array(_keep(mesh.vertex_indices), dtype=np.int64)
    faces = np.array([(face.index_begin, face.num_indices) for face in _all(mesh.faces)], dtype=np.int64)
    triangles = []
    for sides in np.unique(faces[:, 1]):
        starts = faces[faces[:, 1] == sides, 0]
        for second in range(1, int(sides) - 1):
            triangles.append(np.stack([starts, starts + second, starts + second + 1], axis=1))
    return corners[np.concatenate(triangles)].ravel()


def _add_skin(glb: _Glb, bones: list[Any], count: int, attributes: dict[str, int]) -> int:
    """Adds the skin of a mesh, and the weights of its vertices to its attributes; returns the number of the skin."""
    weights = np.zeros((count, len(bones)))
    binds = np.zeros((len(bones), 4, 4))
    for column, bone in enumerate(bones):
        weights[np.array(_keep(bone.vertices), dtype=np.int64), column] = np.array(
            _keep(bone.weights), dtype=np.float64
        )
        binds[column, :, :3] = np.array(bone.geometry_to_bone)
        binds[column, 3, 3] = 1
    most = np.argsort(-weights, axis=1)[:, :_WEIGHTS]
    most = np.pad(most, ((0, 0), (0, _WEIGHTS - most.shape[1])))
    kept = np.take_along_axis(weights, most, axis=1)
    kept[:, len(bones) :] = 0
    kept = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1e-12)
    attributes["JOINTS_0"] = glb.array(most.astype("<u2"), "VEC4")
    attributes["WEIGHTS_0"] = glb.array(kept.astype("<f4"), "VEC4")
    joints = [_keep(bone.bone_node).typed_id for bone in bones]
    matrices = glb.array(binds.astype("<f4").reshape(-1, 16), "MAT4")
    return glb.add("skins", {"joints": joints, "inverseBindMatrices": matrices})


def _add_animations(glb: _Glb, ufbx: Any, scene: Any, nodes: list[Any]) -> None:
    rate = float(np.clip(_keep(scene.settings).frames_per_second or 30.0, *_RATES))
    for stack in _all(scene.anim_stacks):
        first, last = stack.time_begin, stack.time_end
        if not last > first:  # a file without the range of its animation: that of all keys
            first, last = _key_range(scene)
        count = int(np.floor((last - first) * rate + 1e-3)) + 1
        if count * len(nodes) * 10 > _NUMBERS_MAX:
            raise ValueError(f"an animation of {count} frames of {len(nodes)} nodes")
        anim, moments = _keep(stack.anim), first + np.arange(count) / rate
        posed = np.empty((count, len(nodes), 10))
        for frame, moment in enumerate(moments):
            for place, node in enumerate(nodes):
                turn = ufbx.evaluate_transform(anim, node, float(moment))
                posed[frame, place] = (*turn.translation, *turn.rotation, *turn.scale)
        times = glb.array((np.arange(count) / rate).astype("<f4"), "SCALAR")
        entry: dict[str, Any] = {"name": stack.name, "channels": [], "samplers": []}
        moving = np.ptp(posed, axis=0) > _MOVES
        for place in range(1, len(nodes)):
            for path, part, shape in (
                ("translation", slice(0, 3), "VEC3"),
                ("rotation", slice(3, 7), "VEC4"),
                ("scale", slice(7, 10), "VEC3"),
            ):
                if not moving[place, part].any() and (path != "rotation" or moving.any()):
                    continue
                output = glb.array(posed[:, place, part].astype("<f4"), shape)
                entry["samplers"].append({"input": times, "output": output})
                target = {"node": place, "path": path}
                entry["channels"].append({"sampler": len(entry["samplers"]) - 1, "target": target})
        if entry["channels"]:
            glb.add("animations", entry)


def _key_range(scene: Any) -> tuple[float, float]:
    """Returns the times of the first and the last key [s]."""
    times = [time for curve in _all(scene.anim_curves) for time in (curve.min_time, curve.max_time)]
    return (min(times), max(times)) if times else (0.0, 0.0)


def main() -> int:
    """Converts stdin to stdout."""
    try:
        sys.stdout.buffer.write(convert(sys.stdin.buffer.read()))
        sys.stdout.flush()
    except Exception as reason:  # the library raises errors of its own kind; the caller shows the last line
        sys.stderr.write(f"{reason}\n")
        sys.stderr.flush()
        return 1
    return 0


if __name__ == "__main__":
    status = main()
    os._exit(status)  # without freeing what the library may free again
