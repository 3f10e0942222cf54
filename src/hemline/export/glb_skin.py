"""A skinned mesh in a GLB document: joints as nodes, their rotations and the root's path as an animation."""

import numpy as np

from hemline.arrays import Float, Quaternions
from hemline.meshes import vertex_normals

from .clip import Part, Skeleton
from .glb_buffer import Buffer


def add_skin(document: dict, buffer: Buffer, part: Part, skeleton: Skeleton, times: int) -> None:
    r"""Add a body that follows its skeleton.

    With skin transforms $A_j = [R_j | t_j]$ and rest joints $J_j$, the node of joint $j$ stands at $A_j J_j$ with
    rotation $R_j$, so its inverse bind matrix is a shift by $-J_j$. Relative to its parent it turns by $R_p^T R_j$ and
    stands at $J_j - J_p$, the same in all frames; only the root moves.

    Args:
        document: The glTF document, changed in place.
        buffer: The buffer of the document.
        part: The body.
        skeleton: Its joints and weights.
        times: Accessor of the frames' times.
    """
    joints = np.asarray(skeleton.joints, np.float32)
    first, root = len(document["nodes"]), int(np.flatnonzero(np.asarray(skeleton.parents) < 0)[0])
    document["nodes"] += _joint_nodes(skeleton, first)
    bind = np.tile(np.eye(4, dtype=np.float32), (len(joints), 1, 1))
    bind[:, 3, :3] = -joints  # columns first, so the shift is in the last row
    matrices = buffer.add(bind.reshape(-1, 16), "MAT4")
    skin = {
        "inverseBindMatrices": matrices,
        "joints": list(range(first, first + len(joints))),
        "skeleton": first + root,
    }
    document.setdefault("skins", []).append(skin | {"name": f"{part.name} skeleton"})
    mesh_node = len(document["nodes"])
    document["nodes"].append({"name": part.name, "mesh": len(document["meshes"]), "skin": len(document["skins"]) - 1})
    document["scenes"][0]["nodes"] += [mesh_node, first + root]
    primitive = {
        "attributes": _attributes(buffer, part, skeleton),
        "indices": buffer.add_indices(part.faces),
        "material": len(document["materials"]) - 1,
    }
    document["meshes"].append({"name": part.name, "primitives": [primitive]})
    _animate(document["animations"][0], buffer, skeleton, first, root, times)


def _joint_nodes(skeleton: Skeleton, first: int) -> list[dict]:
    joints, parents = np.asarray(skeleton.joints, np.float64), np.asarray(skeleton.parents)
    nodes = []
    for joint, parent in enumerate(parents):
        at = joints[joint] - (joints[parent] if parent >= 0 else 0)
        node = {"name": skeleton.names[joint] if skeleton.names else f"joint_{joint}", "translation": at.tolist()}
        children = [first + int(child) for child in np.flatnonzero(parents == joint)]
        nodes.append(node | ({"children": children} if children else {}))
    return nodes


def _attributes(buffer: Buffer, part: Part, skeleton: Skeleton) -> dict[str, int]:
    weights = np.asarray(skeleton.weights, np.float32)
    order = np.argsort(-weights, axis=1, kind="stable")
    weights = np.take_along_axis(weights, order, axis=1)
    indices = np.take_along_axis(np.asarray(skeleton.weight_indices), order, axis=1)
    sets = -(-weights.shape[1] // 4)
    spare = ((0, 0), (0, 4 * sets - weights.shape[1]))
    weights = np.pad(weights / weights.sum(axis=1, keepdims=True), spare)
    indices = np.where(weights > 0, np.pad(indices, spare), 0).astype(np.uint16)
    attributes = {
        "POSITION": buffer.add_attribute(np.asarray(skeleton.vertices, np.float32), "VEC3", bounds=True),
        "NORMAL": buffer.add_attribute(_normals(skeleton.vertices, part.faces), "VEC3"),
    }
    for each in range(sets):
        four = slice(4 * each, 4 * each + 4)
        attributes[f"JOINTS_{each}"] = buffer.add_attribute(indices[:, four], "VEC4")
        attributes[f"WEIGHTS_{each}"] = buffer.add_attribute(weights[:, four], "VEC4")
    return attributes


def _animate(animation: dict, buffer: Buffer, skeleton: Skeleton, first: int, root: int, times: int) -> None:
    rotations = np.asarray(skeleton.transforms, np.float64)[..., :3]
    parents = np.asarray(skeleton.parents)
    local = rotations.copy()
    child = np.flatnonzero(parents >= 0)
    local[:, child] = np.swapaxes(rotations[:, parents[child]], -1, -2) @ rotations[:, child]
    path = rotations[:, root] @ np.asarray(skeleton.joints[root], np.float64) + skeleton.transforms[:, root, :, 3]
    tracks = [(root, "translation", path.astype(np.float32), "VEC3")]
    tracks += [(joint, "rotation", _continuous(local[:, joint]), "VEC4") for joint in range(len(parents))]
    for joint, what, values, kind in tracks:
        channel = {"sampler": len(animation["samplers"]), "target": {"node": first + joint, "path": what}}
        animation["channels"].append(channel)
        output = buffer.add(values, kind)
        animation["samplers"].append({"input": times, "output": output, "interpolation": "LINEAR"})


def _continuous(rotations: Float[np.ndarray, "frames 3 3"]) -> Quaternions:
    """Quaternions xyzw, as glTF has them, without jumps of sign."""
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix(rotations).as_quat()
    flips = np.sign(np.sum(quaternions[1:] * quaternions[:-1], axis=1))
    quaternions[1:] *= np.cumprod(np.where(flips == 0, 1, flips))[:, None]
    return quaternions.astype(np.float32)


def _normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    normals = vertex_normals(np.asarray(vertices, np.float32), faces)
    normals[~normals.any(axis=1)] = (0.0, 1.0, 0.0)  # a vertex without triangles; the format wants unit length
    return normals
