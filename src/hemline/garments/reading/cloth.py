"""The mesh of a garment, with its flat rest triangles, before it is pinned to a body."""

from dataclasses import dataclass, replace

import numpy as np

from hemline.arrays import Faces, Float, Vertices
from hemline.meshes import ClosestTree, consistent_winding, vertex_normals

from .rest_shape import rewind_rest_edges


@dataclass(frozen=True, eq=False)
class GarmentCloth:
    """A mesh that becomes a garment."""

    name: str
    """Name of the garment."""
    vertices: Vertices
    """Positions, float64 [m]: where the file has them, or on the body at rest once it is placed."""
    faces: Faces
    """Triangles, wound consistently."""
    rest_edges: Float[np.ndarray, "faces 2 2"]
    """Flat rest triangle of each face [m]."""
    from_pattern: bool
    """Whether the rest triangles come from a flat pattern."""
    notes: tuple[str, ...]
    """What was guessed or changed so far, one sentence each."""
    coarse: bool = False
    """Whether the triangles are so large that skin may come through them, so that the cloth must be raised there."""


def wind_consistently(cloth: GarmentCloth) -> GarmentCloth:
    """Turns triangles that disagree with their neighbours: the openings of a garment are found by its winding."""
    faces, turned = consistent_winding(cloth.faces)
    if not turned:
        return cloth
    return _with_faces(cloth, faces, f"winding: {turned} triangles were turned to agree with their neighbours")


def wind_outward(cloth: GarmentCloth, tree: ClosestTree) -> GarmentCloth:
    """Turns all triangles over where most of them face the body.

    Args:
        cloth: The mesh, on the body.
        tree: The surface of the body at rest.
    """
    side = (tree.outward(tree.closest(cloth.vertices)) * vertex_normals(cloth.vertices, cloth.faces)).sum(axis=1)
    if (side > 0).mean() >= 0.5:
        return cloth
    faces = np.ascontiguousarray(cloth.faces[:, [0, 2, 1]])
    return _with_faces(cloth, faces, "winding: all triangles were turned to face away from the body")


def _with_faces(cloth: GarmentCloth, faces: Faces, note: str) -> GarmentCloth:
    rest_edges = rewind_rest_edges(cloth.rest_edges, cloth.faces, faces)
    return replace(cloth, faces=faces, rest_edges=rest_edges, notes=(*cloth.notes, note))
