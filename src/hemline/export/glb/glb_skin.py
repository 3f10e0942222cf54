"""A skinned mesh in a GLB document: joints as nodes, their rotations and the roots' paths as an animation."""

import numpy as np

from hemline.arrays import Float, Quaternions
from hemline.export.clip import ClipPart, ClipSkeleton
from hemline.export.shading import unit_normals

from .glb_buffer import Buffer
from .glb_quantized import QuantizedGrid, directions, quantized_weights

_METRE = 1.0
"""Half side of the grid for meshes up to 2 m, so that bind matrices need no scale, which Blender would drop [m]."""


def add_skin(
    document: dict, buffer: Buffer, part: ClipPart, skeleton: ClipSkeleton, times: int, *, quantized: bool
) -> None:
    r"""Adds a mesh that follows its skeleton.

    With skin transforms $A_j = [R_j | t_j]$ and rest joints $J_j$, the node of joint $j$ stands at $A_j J_j$ with
    rotation $R_j$, so its inverse bind matrix is a shift by $-J_j$. Relative to its parent it turns by $R_p^T R_j$ and
    stands at $J_j - J_p$, the same in all frames; only roots move. Several roots get a node above them.

    Args:
        document: The glTF document, changed in place.
        buffer: The buffer of the document.
        part: The mesh.
        skeleton: Its joints and weights.
        times: Accessor of the times of frames.
        quantized: Whether to use two bytes per number for positions and weights, and one for normals.
    """
    joints = np.asarray(skeleton.joints, np.float32)
    first, roots = len(document["nodes"]), np.flatnonzero(np.asarray(skeleton.parents) < 0)
    document["nodes"] += _joint_nodes(skeleton, first)
    top = first + int(roots[0])
    if len(roots) > 1:
        top = len(document["nodes"])
        document["nodes"].append({"name": f"{part.name} bones", "children": (first + roots).tolist()})
    rest = np.asarray(skeleton.vertices, np.float32)
    grid = QuantizedGrid.around(rest, least=_METRE) if quantized else None
    skin = {
        "inverseBindMatrices": buffer.add(_binds(joints, grid), "MAT4"),
        "joints": list(range(first, first + len(joints))),
        "skeleton": top,
    }
    document.setdefault("skins", []).append(skin | {"name": f"{part.name} skeleton"})
    mesh_node = len(document["nodes"])
    document["nodes"].append({"name": part.name, "mesh": len(document["meshes"]), "skin": len(document["skins"]) - 1})
    document["scenes"][0]["nodes"] += [mesh_node, top]
    normals = unit_normals(rest, part.faces)
    primitive = {
        "attributes": {
            "POSITION": buffer.add_attribute(rest if grid is None else grid.numbers(rest), "VEC3", bounds=True),
            "NORMAL": buffer.add_attribute(normals if grid is None else directions(normals), "VEC3"),
            **_weights(buffer, skeleton, quantized),
        },
        "indices": buffer.add_indices(part.faces),
        "material": len(document["materials"]) - 1,
    }
    document["meshes"].append({"name": part.name, "primitives": [primitive]})
    _animate(document["animations"][0], buffer, skeleton, first, times)


def _binds(joints: np.ndarray, grid: QuantizedGrid | None) -> np.ndarray:
    """Returns inverse bind matrices, column by column: from the grid to metres, then to the joint."""
    scale, middle = (1.0, np.zeros(3)) if grid is None else (grid.scale, grid.middle)
    bind = np.tile(np.diag([scale, scale, scale, 1.0]), (len(joints), 1, 1))
    bind[:, 3, :3] = middle - joints
    return bind.reshape(-1, 16).astype(np.float32)


def _joint_nodes(skeleton: ClipSkeleton, first: int) -> list[dict]:
    parents, nodes = np.asarray(skeleton.parents), []
    for joint, at in enumerate(skeleton.rest_places.tolist()):
        node = {"name": skeleton.names[joint] if skeleton.names else f"joint_{joint}", "translation": at}
        children = [first + int(child) for child in np.flatnonzero(parents == joint)]
        nodes.append(node | ({"children": children} if children else {}))
    return nodes


def _weights(buffer: Buffer, skeleton: ClipSkeleton, quantized: bool) -> dict[str, int]:
    """Returns accessors of joints and weights in sets of four, the largest first."""
    weights = np.asarray(skeleton.weights, np.float32)
    order = np.argsort(-weights, axis=1, kind="stable")
    weights = np.take_along_axis(weights, order, axis=1)
    indices = np.take_along_axis(np.asarray(skeleton.weight_indices), order, axis=1)
    sets = -(-np.count_nonzero(weights.any(axis=0)) // 4)
    spare = ((0, 0), (0, max(4 * sets - weights.shape[1], 0)))
    weights = np.pad(weights / weights.sum(axis=1, keepdims=True), spare)[:, : 4 * sets]
    packed = quantized_weights(weights) if quantized else weights
    indices = np.where(packed > 0, np.pad(indices, spare)[:, : 4 * sets], 0)
    indices = indices.astype(np.uint8 if len(skeleton.joints) <= 256 else np.uint16)
    attributes = {}
    for each in range(sets):
        four = slice(4 * each, 4 * each + 4)
        attributes[f"JOINTS_{each}"] = buffer.add_numbers(indices[:, four], "VEC4")
        attributes[f"WEIGHTS_{each}"] = buffer.add_attribute(packed[:, four], "VEC4")
    return attributes


def _animate(animation: dict, buffer: Buffer, skeleton: ClipSkeleton, first: int, times: int) -> None:
    turns = skeleton.turns
    tracks = [(root, "translation", path.astype(np.float32), "VEC3") for root, path in skeleton.root_paths.items()]
    tracks += [(joint, "rotation", _continuous(turns[:, joint]), "VEC4") for joint in range(turns.shape[1])]
    for joint, what, values, kind in tracks:
        channel = {"sampler": len(animation["samplers"]), "target": {"node": first + joint, "path": what}}
        animation["channels"].append(channel)
        output = buffer.add(values, kind)
        animation["samplers"].append({"input": times, "output": output, "interpolation": "LINEAR"})


def _continuous(rotations: Float[np.ndarray, "frames 3 3"]) -> Quaternions:
    """Returns quaternions xyzw without jumps of sign."""
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix(rotations).as_quat()
    flips = np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=1))
    quaternions[1:] *= np.cumprod(np.where(flips == 0, 1, flips))[:, None]
    return quaternions.astype(np.float32)
