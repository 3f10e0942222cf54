"""Training frames of one garment as plain arrays. Coordinates are those of a `PelvisFrame`."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float


@dataclass(frozen=True, eq=False)
class FrameBatch:
    """Some frames of one garment, float32. The pelvis is the origin, and its heading is removed."""

    motion: Float[np.ndarray, "frames poses 75"]
    """The last 65 poses, the present one last: axis-angles, displacement of the pelvis [m]."""
    transforms: Float[np.ndarray, "frames joints 3 4"]
    """Skinning transforms of the joints [m]."""
    joints: Float[np.ndarray, "frames joints 3"]
    """Positions of the joints [m]."""
    body: Float[np.ndarray, "frames body"]
    """Betas and axis-angles of the present pose."""
    heading: Float[np.ndarray, "frames 3 3"]
    """Rotations from the frame's own heading to one that all frames of a clip share."""
    truth: Float[np.ndarray, "frames verts 3"]
    """Vertices of the ground truth [m]."""
    features: Float[np.ndarray, "frames verts features"] | None = None
    """Features of the vertices, see `graph_inputs.vertex_inputs`."""
    turns: Float[np.ndarray, "frames verts 4"] | None = None
    """Rotation of each vertex by skinning, wxyz."""
