"""Reads common mesh files as one triangle mesh."""

import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from hemline.errors import BadMesh
from hemline.files.reading import TEXT_MAX, read_bytes

from .mesh import ReadMesh
from .read_gltf import read_gltf_mesh
from .read_obj import read_obj
from .read_ply import read_ply

MESH_ENDINGS = (".obj", ".ply", ".glb", ".gltf", ".vrm", ".stl")
"""File endings that `read_mesh` accepts."""


def read_mesh(path: str | Path) -> ReadMesh:
    """Reads a mesh file: OBJ, PLY and glTF (GLB, VRM) by hemline's own readers, STL by trimesh without any clean-up.

    STL has no shared vertices: equal positions are merged, and a note says so.

    Args:
        path: The file; its ending selects the format.

    Returns:
        The mesh, in the unit of the file.

    Raises:
        BadMesh: The ending is unknown, or the file is missing, too large, damaged or without triangles.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in MESH_ENDINGS:
        raise BadMesh(f"{path} has no known mesh ending", repr(ending), f"use one of {' '.join(MESH_ENDINGS)}")
    if ending == ".obj":
        return read_obj(path)
    if ending == ".ply":
        return read_ply(path)
    if ending in (".glb", ".gltf", ".vrm"):
        return read_gltf_mesh(path)
    content = read_bytes(path, TEXT_MAX, error=BadMesh, cure="name a mesh file that exists")
    return _through_trimesh(path, ending, content)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silences logs and warnings of trimesh and NumPy while they read a damaged file."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logging.disable(before)


def _through_trimesh(path: Path, ending: str, content: bytes) -> ReadMesh:
    import trimesh

    # its readers raise whatever the parser meets: ValueError, KeyError, struct.error, IndexError ...
    # given bytes in the place of a path, it cannot find other files that the file may name
    try:
        with _quiet():
            loaded = trimesh.load(io.BytesIO(content), file_type=ending[1:], process=False, maintain_order=True)
            meshes = loaded.dump() if isinstance(loaded, trimesh.Scene) else [loaded]
            meshes = [mesh for mesh in meshes if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces)]
    except Exception as error:
        got = "a damaged file, or one of another format" if content else "an empty file"
        raise BadMesh(f"{path} cannot be read as {ending}", got, "export it again, or as .obj") from error
    if not meshes:
        raise BadMesh(f"{path} must have triangles", "none", "export the mesh again with faces")
    first = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    vertices = np.concatenate([np.asarray(mesh.vertices, np.float64) for mesh in meshes])
    faces = np.concatenate(
        [np.asarray(mesh.faces, np.int64) + start for mesh, start in zip(meshes, first, strict=False)]
    )
    if faces.min() < 0 or faces.max() >= len(vertices):
        wrong = faces.min() if faces.min() < 0 else faces.max()
        raise BadMesh(f"{path}: a face names vertex {wrong}", f"{len(vertices)} vertices", "export the mesh again")
    notes = (f"{len(meshes)} meshes of the scene were joined into one",) if len(meshes) > 1 else ()
    vertices, inverse = np.unique(vertices, axis=0, return_inverse=True)
    faces = inverse.reshape(-1)[faces]
    notes += ("STL has no shared vertices: equal positions were merged, vertex ids are new",)
    return ReadMesh(vertices, faces.astype(np.int32), notes=notes)
