"""Types of arrays by shape.

Every axis has one name everywhere: `frames joints verts faces nodes betas pins`. Float32 at run time, float64 where a
solver needs it. Quaternions are wxyz; rotations act on column vectors; metres, y up, right-handed.
"""

import numpy as np
from jaxtyping import Bool, Float, Int, UInt

Vertices = Float[np.ndarray, "verts 3"]
"""Positions of the vertices of one mesh in one frame [m]."""

Normals = Float[np.ndarray, "verts 3"]
"""Unit normals at vertices, area-weighted, outward."""

FramesOfVertices = Float[np.ndarray, "frames verts 3"]
"""Positions of the vertices of one mesh over a clip [m]."""

Faces = Int[np.ndarray, "faces 3"]
"""Triangles as vertex indices, counter-clockwise from outside, int32."""

AnyVertices = Float[np.ndarray, "_verts 3"]
"""Vertices of one of several meshes, whose numbers of vertices differ [m]."""

AnyFaces = Int[np.ndarray, "_faces 3"]
"""Triangles of one of several meshes."""

BodyVertices = Float[np.ndarray, "body_verts 3"]
"""Vertices of a body, where those of a garment are given as well [m]."""

FramesOfBodyVertices = Float[np.ndarray, "frames body_verts 3"]
"""Vertices of a body over a clip [m]."""

BodyFaces = Int[np.ndarray, "body_faces 3"]
"""Triangles of a body, where those of a garment are given as well."""

Points = Float[np.ndarray, "points 3"]
"""Any points [m]."""

Joints = Float[np.ndarray, "joints 3"]
"""Joint positions [m]."""

Quaternions = Float[np.ndarray, "joints 4"]
"""Unit quaternions wxyz, one a joint."""

Transforms = Float[np.ndarray, "joints 3 4"]
"""Rigid transforms [R | t], one a joint."""

Betas = Float[np.ndarray, " betas"]
"""Shape coefficients in units of one standard deviation."""

Nodes = Float[np.ndarray, "nodes 3"]
"""Positions of rope nodes (virtual bones) [m]."""

Mask = Bool[np.ndarray, " verts"]
"""One truth value a vertex."""

__all__ = [
    "AnyFaces",
    "AnyVertices",
    "Betas",
    "BodyFaces",
    "BodyVertices",
    "Bool",
    "Faces",
    "Float",
    "FramesOfBodyVertices",
    "FramesOfVertices",
    "Int",
    "Joints",
    "Mask",
    "Nodes",
    "Normals",
    "Points",
    "Quaternions",
    "Transforms",
    "UInt",
    "Vertices",
]
