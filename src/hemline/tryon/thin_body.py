"""Thin bodies, whose skin is drawn in to the bones, so that a garment fits around them before they grow."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hemline.arrays import Vertices
from hemline.bodies.skinning_kernels import area_normals
from hemline.motions.motion import JOINT_NAMES

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

_CROWN_HEIGHT = 0.1
"""Height of the end of the head's bone above its joint [m]."""


class ThinBody:
    """A body at rest that can be made thin.

    Each vertex moves towards its nearest points on the bones of the joints that move it, by their skin weights.

    Args:
        shaped: The body.
    """

    def __init__(self, shaped: "ShapedBody"):
        self.shaped = shaped
        self.axis = _axis(shaped)

    def at(self, fraction: float) -> "ShapedBody":
        """Returns the body with a fraction of its girth; 1 is the full body."""
        if fraction >= 1:
            return self.shaped
        vertices = (self.axis + fraction * (self.shaped.vertices - self.axis)).astype(np.float32)
        normals = np.empty_like(vertices)
        area_normals(vertices, self.shaped.body.faces, normals)
        return replace(self.shaped, vertices=vertices, normals=normals)


def _axis(shaped: "ShapedBody") -> Vertices:
    body, joints = shaped.body, shaped.joints.astype(np.float64)
    points = shaped.vertices.astype(np.float64)
    near = np.empty((len(joints), *points.shape))
    for joint in range(len(joints)):
        ends = [joints[child] for child in np.flatnonzero(body.parents == joint)] or [joints[joint]]
        if JOINT_NAMES[joint] == "head":
            ends = [joints[joint] + (0, _CROWN_HEIGHT, 0)]
        on = np.stack([_on_segment(points, joints[joint], end) for end in ends])
        nearest = np.linalg.norm(on - points, axis=2).argmin(axis=0)
        near[joint] = on[nearest, np.arange(len(points))]
    of_each = near[body.weight_indices, np.arange(len(points))[:, None]]
    return (body.weights[:, :, None] * of_each).sum(axis=1)


def _on_segment(points: Vertices, start: np.ndarray, end: np.ndarray) -> Vertices:
    direction = end - start
    fraction = np.clip((points - start) @ direction / max(float(direction @ direction), 1e-12), 0, 1)
    return start + fraction[:, None] * direction
