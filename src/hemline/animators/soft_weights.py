"""Skin weights for cloth that may hang far from the body: the farther away, the smoother they are."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.arrays import BodyVertices, Float, Int, Vertices
from hemline.motions.motion import JOINT_COUNT

if TYPE_CHECKING:
    from hemline.bodies import Body

INFLUENCES = 8
"""Largest number of joints of a vertex."""
BLUR_FRACTION = 0.5
"""Radius of the smoothing, relative to the distance from the nearest skin. At twice this radius skinning
stretches a wide skirt more."""
MIN_BLUR = 0.01
"""Smallest radius of the smoothing, used for cloth on the skin [m]."""


class SoftWeights(NamedTuple):
    """Sparse skin weights."""

    joints: Int[np.ndarray, "verts influences"]
    """Joints of each vertex, the heaviest first."""
    weights: Float[np.ndarray, "verts influences"]
    """Weights of these joints; rows add up to 1."""

    def dense(self) -> Float[np.ndarray, "verts joints"]:
        """Returns the weights with one column a joint, float32."""
        rows = np.zeros((len(self.joints), JOINT_COUNT), np.float32)
        np.add.at(rows, (np.arange(len(rows))[:, None], self.joints), self.weights)
        return rows


def soft_weights(vertices: Vertices, body: "Body", skin: BodyVertices) -> SoftWeights:
    r"""Averages skin weights of the body's vertices $b$ for a cloth vertex at $x$ whose nearest skin is $d$ away:

    $$w \propto \sum_b w_b \exp\left(-\frac{|x - x_b|^2 - d^2}{2 s^2}\right), \qquad s = \max(0.01, d / 2)$$

    Cloth on the skin gets the weights under it. The hem of a skirt, as near to one leg as to the other, gets those of
    both legs, so that skinning does not tear it.

    Args:
        vertices: The garment (verts, 3) [m].
        body: The body that it is on.
        skin: Vertices of the body in the same pose (body_verts, 3) [m].
    """
    points = skin.astype(np.float32)
    skin_weights = np.zeros((len(points), JOINT_COUNT), np.float32)
    np.add.at(skin_weights, (np.arange(len(points))[:, None], body.weight_indices), body.weights)
    vertices = vertices.astype(np.float32)
    dense = np.empty((len(vertices), JOINT_COUNT), np.float32)
    for first in range(0, len(vertices), 256):
        part = vertices[first : first + 256]
        squared = ((part[:, None] - points[None]) ** 2).sum(axis=2)
        nearest = squared.min(axis=1, keepdims=True)
        breadth = np.maximum(MIN_BLUR, BLUR_FRACTION * np.sqrt(nearest))
        dense[first : first + 256] = np.exp((nearest - squared) / (2 * breadth**2)) @ skin_weights
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES].astype(np.int32)
    weights = np.take_along_axis(dense, joints, axis=1)
    return SoftWeights(joints, np.ascontiguousarray(weights / weights.sum(axis=1, keepdims=True)))
