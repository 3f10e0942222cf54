"""Measures the connected parts of a mesh: size, area, rims and what they enclose."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Int
from hemline.meshes import ReadMesh, components, face_areas
from hemline.meshes.edges import directed_edges


@dataclass(frozen=True, eq=False)
class PartShapes:
    """The connected parts of a mesh, in the order of their first vertices.

    Attributes:
        face_parts: Part of each triangle.
        vertex_parts: Part of each vertex.
        low: Lowest corner of the box around each part [unit of the mesh].
        high: Highest corner of the box [unit of the mesh].
        areas: Area of each part [unit squared].
        volumes: Volume that each part encloses if it is closed [unit cubed].
        rims: Length of all rims of each part over the root of its area [1].
        handles: Genus of each part if it is closed: a ball has 0, a ring 1.
        counts: Number of triangles.
        names: Names of each part in its file, joined.
    """

    face_parts: Int[np.ndarray, " faces"]
    vertex_parts: Int[np.ndarray, " verts"]
    low: Float[np.ndarray, "parts 3"]
    high: Float[np.ndarray, "parts 3"]
    areas: Float[np.ndarray, " parts"]
    volumes: Float[np.ndarray, " parts"]
    rims: Float[np.ndarray, " parts"]
    handles: Float[np.ndarray, " parts"]
    counts: Int[np.ndarray, " parts"]
    names: tuple[str, ...]

    @property
    def sizes(self) -> Float[np.ndarray, " parts"]:
        """Longest side of the box around each part [unit of the mesh]."""
        return (self.high - self.low).max(axis=1)

    @property
    def solidity(self) -> Float[np.ndarray, " parts"]:
        """Volume over area and size [1]: 0.17 for a cube, 0.02 for a person, 0.005 for a thick shirt."""
        return self.volumes / np.maximum(self.areas * self.sizes, 1e-300)

    def name(self, part: int) -> str:
        """Returns the first name of a part in quotes; its number if it has none."""
        first = self.names[part].split("\n")[0]
        return f"'{first[:40]}'" if first else f"number {part}"


def part_shapes(mesh: ReadMesh) -> PartShapes:
    """Measures the connected parts of a mesh without loose vertices.

    Args:
        mesh: The mesh, its triangles wound consistently where possible.
    """
    vertex_parts = components(mesh.faces, len(mesh.vertices))
    face_parts = vertex_parts[mesh.faces[:, 0]]
    count = int(vertex_parts.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, vertex_parts, mesh.vertices)
    np.maximum.at(high, vertex_parts, mesh.vertices)
    areas = np.bincount(face_parts, face_areas(mesh.vertices, mesh.faces), count)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] - 0.5 * (low + high)[face_parts] for k in range(3))
    volumes = np.abs(np.bincount(face_parts, (a * np.cross(b, c)).sum(axis=1) / 6, count))
    directed = directed_edges(mesh.faces)
    pairs, times = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    rim = pairs[times == 1]
    lengths = np.linalg.norm(mesh.vertices[rim[:, 0]] - mesh.vertices[rim[:, 1]], axis=1)
    rims = np.bincount(vertex_parts[rim[:, 0]], lengths, count) / np.sqrt(np.maximum(areas, 1e-300))
    edges = np.bincount(vertex_parts[pairs[:, 0]], minlength=count)
    counts = np.bincount(face_parts, minlength=count)
    handles = 1 - (np.bincount(vertex_parts, minlength=count) - edges + counts) / 2
    return PartShapes(
        face_parts, vertex_parts, low, high, areas, volumes, rims, handles, counts, _names(mesh, face_parts, count)
    )


def _names(mesh: ReadMesh, face_parts: np.ndarray, count: int) -> tuple[str, ...]:
    """Returns the names of the first triangle of each part, one a line."""
    if mesh.face_labels is None:
        return ("",) * count
    first = np.unique(face_parts, return_index=True)[1]
    return tuple("\n".join(name for name in mesh.labels[mesh.face_labels[face]] if name) for face in first)
