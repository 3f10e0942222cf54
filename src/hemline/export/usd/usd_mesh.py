"""Functions for point-cache and skinned meshes of a USD stage."""

# pxr is compiled and has no types
# pyright: reportAttributeAccessIssue=false

import numpy as np

from hemline.arrays import Vertices
from hemline.export.clip import ClipPart
from hemline.pictures import linear


def add_mesh(stage, path: str, part: ClipPart):
    """Adds a mesh with triangles and colour, without points."""
    from pxr import Gf, UsdGeom, Vt

    mesh = UsdGeom.Mesh.Define(stage, path)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(True)
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(part.faces), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(part.faces, np.int32).ravel()))
    mesh.CreateDisplayColorAttr([Gf.Vec3f(*linear(part.colour).tolist())])
    return mesh


def bounds_of(vertices: Vertices):
    """Returns the lowest and the highest corner of the bounding box of vertices [m]."""
    from pxr import Vt

    solid = np.asarray(vertices, np.float32)
    return Vt.Vec3fArray.FromNumpy(np.stack([solid.min(axis=0), solid.max(axis=0)]))
