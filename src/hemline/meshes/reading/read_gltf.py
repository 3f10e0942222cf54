"""Reads GLB and glTF files as one triangle mesh; textures and animations are ignored."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.errors import BadMesh
from hemline.files.gltf import Gltf, read_gltf
from hemline.files.gltf_nodes import Nodes, read_nodes
from hemline.files.gltf_skins import BindPose, bind_pose, skin_joints
from hemline.files.gltf_triangles import PRIMITIVES_MAX, triangles

from .mesh import ReadMesh

_VERTEX_BYTES = 4
"""Bytes of a file for each vertex, at least; a vertex takes 12, but its mesh may be shown several times."""


@dataclass(frozen=True, eq=False)
class _Part:
    """A primitive where the scene shows it."""

    vertices: np.ndarray
    faces: np.ndarray
    label: tuple[str, ...]
    """Names of node, mesh and material."""
    colours: np.ndarray | None
    marks: dict[str, np.ndarray]


def read_gltf_mesh(path: str | Path) -> ReadMesh:
    """Reads all triangles of a GLB, VRM or glTF file as one mesh, each part where the scene places it.

    Skinned parts are in the pose that they were bound in; the transform of their node does not count. Morph targets
    are at zero. Vertices keep their order: those of the first node that shows a mesh, then of the next one; where
    several primitives share their vertices, each has those that it uses. Of the files that it names, only buffers
    beside it are read.

    Args:
        path: The file.

    Returns:
        The mesh, in the unit of the file.

    Raises:
        BadMesh: The file is missing, damaged, without triangles, compressed by what is not installed, or has more
            vertices than its size allows.
    """
    path = Path(path)
    gltf = read_gltf(path, error=BadMesh)
    nodes = read_nodes(gltf)
    skins = skin_joints(gltf, len(nodes.names))
    with gltf.readable(), np.errstate(all="ignore"):
        pose = bind_pose(gltf, nodes, skins)
        parts = list(_parts(gltf, nodes, pose))
        morphed = any("targets" in each for mesh in gltf.all("meshes") for each in mesh["primitives"])
    if not parts:
        raise BadMesh(f"{path} must have triangles", "none", "export the mesh again with faces")
    first = np.cumsum([0] + [len(part.vertices) for part in parts])
    notes = (f"{len(parts)} meshes of the scene were joined into one",) if len(parts) > 1 else ()
    if any(skins):
        notes += ("skin: in the pose that it was bound in",)
    if morphed:
        notes += ("shape keys: at zero",)
    coloured = [part.colours for part in parts if part.colours is not None]
    names = sorted({name for part in parts for name in part.marks})
    return ReadMesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, first, strict=False)]).astype(np.int32),
        notes=notes,
        labels=tuple(part.label for part in parts),
        face_labels=np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts]),
        colours=np.concatenate(coloured) if len(coloured) == len(parts) else None,
        marks={
            name: np.concatenate([part.marks.get(name, np.zeros(len(part.vertices), bool)) for part in parts])
            for name in names
        },
    )


def _parts(gltf: Gltf, nodes: Nodes, pose: BindPose) -> Iterator[_Part]:
    """Yields each primitive at each place where the scene shows it."""
    primitives = corners = vertices = 0
    shared = _positions_of_several(gltf)
    for node in _scene_nodes(gltf, nodes):
        entry = gltf.all("nodes")[node]
        mesh = gltf.all("meshes")[entry["mesh"]] if "mesh" in entry else {"primitives": ()}
        for primitive in mesh["primitives"]:
            primitives += 1
            if primitives > PRIMITIVES_MAX:
                raise BadMesh(f"{gltf.path} may show {PRIMITIVES_MAX} meshes", "more", "join them")
            faces = triangles(gltf, primitive)
            if not len(faces):
                continue
            points = gltf.array(primitive["attributes"]["POSITION"])
            if points.ndim != 2 or points.shape[1] != 3:
                raise ValueError("POSITION")
            used = np.arange(len(points))
            if primitive["attributes"]["POSITION"] in shared:
                used, rows = np.unique(faces, return_inverse=True)
                faces = rows.reshape(-1, 3)
            corners, vertices = corners + faces.size, vertices + len(used)
            gltf.refuse_more(max(corners, _VERTEX_BYTES * vertices))
            skinned = "skin" in entry and "JOINTS_0" in primitive["attributes"]
            place = pose.skins[entry["skin"]] if skinned else pose.nodes[node]
            if np.linalg.det(place[:3, :3]) < 0:
                faces = faces[:, [0, 2, 1]]
            placed = points[used].astype(np.float64) @ place[:3, :3].T + place[:3, 3]
            yield _Part(placed, faces, _label(gltf, nodes, node, mesh, primitive), *_attributes(gltf, primitive, used))


def _positions_of_several(gltf: Gltf) -> set[int]:
    """Returns the accessors of positions that several primitives share, as they do for the materials of a mesh."""
    named = [each["attributes"]["POSITION"] for mesh in gltf.all("meshes") for each in mesh["primitives"]]
    return {each for each, times in Counter(named).items() if times > 1}


def _label(gltf: Gltf, nodes: Nodes, node: int, mesh: dict, primitive: dict) -> tuple[str, ...]:
    """Returns the names of node, mesh and material of a primitive."""
    material = gltf.all("materials")[primitive["material"]].get("name") if "material" in primitive else None
    return (nodes.names[node], str(mesh.get("name") or ""), str(material or ""))


def _attributes(gltf: Gltf, primitive: dict, used: np.ndarray) -> tuple[np.ndarray | None, dict[str, np.ndarray]]:
    """Returns the colours of vertices, and which of them each attribute of the file's own marks."""
    attributes = primitive["attributes"]
    colours, marks = None, {}
    count = len(gltf.array(attributes["POSITION"]))
    for name, accessor in attributes.items():
        if name == "COLOR_0" or (name.startswith("_") and len(name) < 100):
            values = gltf.array(accessor)
            if len(values) != count:
                raise ValueError(name)
            if name == "COLOR_0" and values.ndim == 2:
                colours = np.clip(values[used, :3].astype(np.float64), 0, 1)
            elif values.ndim == 1:
                marks[name.strip("_").lower()] = values[used] > 0.5
    return colours, marks


def _scene_nodes(gltf: Gltf, nodes: Nodes) -> list[int]:
    """Returns the nodes of the default scene; all nodes of a file without scenes."""
    scenes = gltf.all("scenes")
    if not scenes:
        return list(nodes.order)
    in_scene = set(scenes[gltf.document.get("scene", 0)].get("nodes", ()))
    for node in nodes.order:
        if nodes.parents[node] in in_scene:
            in_scene.add(node)
    return [node for node in nodes.order if node in in_scene]
