"""Reads GLB and glTF files as one triangle mesh; materials, skins and animations are ignored."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hemline.errors import BadMesh
from hemline.files.gltf import Gltf, read_gltf
from hemline.files.gltf_nodes import Nodes, read_nodes
from hemline.files.gltf_triangles import PRIMITIVES_MAX, triangles

from .mesh import ReadMesh

_VERTEX_BYTES = 4
"""Bytes of a file for each vertex, at least; a vertex takes 12, but its mesh may be shown several times."""


def read_gltf_mesh(path: str | Path) -> ReadMesh:
    """Reads all triangles of a GLB, VRM or glTF file as one mesh, each part where the scene places it.

    Vertices keep their order: those of the first node that shows a mesh, then of the next one. Of the files that it
    names, only buffers beside it are read.

    Args:
        path: The file.

    Returns:
        The mesh, in the unit of the file.

    Raises:
        BadMesh: The file is missing, damaged, compressed, without triangles, or has more vertices than its size allows.
    """
    path = Path(path)
    gltf = read_gltf(path, error=BadMesh)
    nodes = read_nodes(gltf)
    with gltf.readable(), np.errstate(all="ignore"):
        parts = list(_parts(gltf, nodes))
    if not parts:
        raise BadMesh(f"{path} must have triangles", "none", "export the mesh again with faces")
    first = np.cumsum([0] + [len(points) for points, _ in parts])
    vertices = np.concatenate([points for points, _ in parts])
    faces = np.concatenate([faces + start for (_, faces), start in zip(parts, first, strict=False)])
    notes = (f"{len(parts)} meshes of the scene were joined into one",) if len(parts) > 1 else ()
    return ReadMesh(vertices, faces.astype(np.int32), notes=notes)


def _parts(gltf: Gltf, nodes: Nodes) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yields vertices and triangles of each primitive at each place where the scene shows it."""
    places = nodes.to_world(nodes.locals)
    primitives = corners = vertices = 0
    for node in _scene_nodes(gltf, nodes):
        entry = gltf.all("nodes")[node]
        for primitive in gltf.all("meshes")[entry["mesh"]]["primitives"] if "mesh" in entry else ():
            primitives += 1
            if primitives > PRIMITIVES_MAX:
                raise BadMesh(f"{gltf.path} may show {PRIMITIVES_MAX} meshes", "more", "join them")
            faces = triangles(gltf, primitive)
            if not len(faces):
                continue
            points = gltf.array(primitive["attributes"]["POSITION"])
            if points.ndim != 2 or points.shape[1] != 3:
                raise ValueError("POSITION")
            corners, vertices = corners + faces.size, vertices + len(points)
            gltf.refuse_more(max(corners, _VERTEX_BYTES * vertices))
            place = places[node]
            if np.linalg.det(place[:3, :3]) < 0:
                faces = faces[:, [0, 2, 1]]
            yield points.astype(np.float64) @ place[:3, :3].T + place[:3, 3], faces


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
