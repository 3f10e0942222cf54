"""Reads a rigid mesh and closes it, since only closed surfaces have an inside that cloth is kept out of."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hemline.arrays import Float, Int
from hemline.bodies.smpl.smpl_holes import close_holes
from hemline.errors import BadBody, BadMesh
from hemline.meshes import clean, coarsen, components, consistent_winding, read_mesh, shell, weld
from hemline.meshes.edges import directed_edges

VERTICES_MAX = 4000
"""Largest number of vertices of an accessory; more are reduced."""

_SHELL_CELLS = 60
"""Number of grid cells along a part that is closed by a shell."""


@dataclass(frozen=True, eq=False)
class Solid:
    """One or several closed surfaces.

    Attributes:
        vertices: Positions, in the unit of the file.
        faces: Triangles, counter-clockwise from outside.
        notes: What was changed to close them, one sentence each.
    """

    vertices: Float[np.ndarray, "verts 3"]
    faces: Int[np.ndarray, "faces 3"]
    notes: tuple[str, ...]


def read_solid(path: Path) -> Solid:
    """Reads a mesh, closes each of its connected parts, and turns their triangles outward.

    Holes are closed by fans of triangles. A part whose holes touch each other, or that has edges of three triangles,
    is replaced by a shell around it.

    Args:
        path: A mesh file, see `meshes.read_mesh`.

    Raises:
        BadBody: The file cannot be read, has NaN, or encloses nothing, such as a single sheet.
    """
    try:
        mesh = weld(clean(read_mesh(path)))
        if not np.isfinite(mesh.vertices).all():
            raise BadMesh(f"{path.name} must have finite vertices", "NaN or infinity", "export the mesh again")
        part = components(mesh.faces, len(mesh.vertices))[mesh.faces[:, 0]]
        parts = [_close(mesh.vertices, mesh.faces[part == each], path.name) for each in np.unique(part)]
    except BadMesh as reason:
        raise BadBody(f"an accessory cannot be made of {path.name}: {reason.what}", reason.got, reason.cure) from reason
    shelled = sum(part.notes != () for part in parts)
    notes = (f"{shelled} of {len(parts)} parts were closed by a shell around them",) if shelled else ()
    first = np.cumsum([0, *(len(part.vertices) for part in parts)])
    vertices = np.concatenate([part.vertices for part in parts])
    faces = np.concatenate([part.faces + at for part, at in zip(parts, first, strict=False)])
    if len(vertices) > VERTICES_MAX:
        fewer = coarsen(vertices, faces.astype(np.int32), VERTICES_MAX)
        notes += (f"{len(vertices)} vertices were reduced to {len(fewer.kept)}",)
        vertices, faces = vertices[fewer.kept], fewer.faces
    return Solid(vertices, faces.astype(np.int32), notes)


def _close(vertices: np.ndarray, faces: np.ndarray, name: str) -> Solid:
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3).astype(np.int32)
    if _edge_counts(faces).max() <= 2:
        whole = close_holes(consistent_winding(faces)[0])
        if (_edge_counts(whole) == 2).all():
            volume = _volume(vertices, whole)
            size = float(np.ptp(vertices, axis=0).max())
            if abs(volume) < 1e-6 * size**3:
                raise BadMesh(
                    "it encloses nothing", f"a sheet in {name}", "give it thickness, or bring it as a garment"
                )
            return Solid(vertices, whole if volume > 0 else whole[:, [0, 2, 1]], ())
    around = shell(vertices, faces, float(np.ptp(vertices, axis=0).max()) / _SHELL_CELLS)
    return Solid(around.vertices, around.faces, ("shell",))


def _edge_counts(faces: np.ndarray) -> np.ndarray:
    return np.unique(np.sort(directed_edges(faces), axis=1), axis=0, return_counts=True)[1]


def _volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    corners = (vertices - vertices.mean(axis=0))[faces]
    return float(np.einsum("fi,fi->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6)
