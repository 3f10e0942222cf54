"""Skin weights for cloth that may hang far from the body: the farther away, the more of the body they look at."""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hemline.arrays import Float, Int, Vertices
from hemline.motions.motion import JOINT_COUNT

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

INFLUENCES = 8
"""Joints of a vertex, at most."""
BLUR_FRACTION = 0.5
"""How far beyond the nearest skin it is looked, as a share of the distance to it."""
MIN_BLUR = 0.01
"""The same for cloth on the skin [m]."""


class SoftWeights(NamedTuple):
    """Joints of each vertex, the heaviest first, and their weights, which add up to 1."""

    joints: Int[np.ndarray, "verts influences"]
    weights: Float[np.ndarray, "verts influences"]

    def dense(self) -> Float[np.ndarray, "verts joints"]:
        """One column a joint."""
        rows = np.zeros((len(self.joints), JOINT_COUNT), np.float32)
        np.add.at(rows, (np.arange(len(rows))[:, None], self.joints), self.weights)
        return rows


def soft_weights(rest: Vertices, shaped: "ShapedBody") -> SoftWeights:
    r"""Skin weights of the body's vertices $b$, averaged for a cloth vertex at $x$ whose nearest skin is $d$ away:

    $$w \propto \sum_b w_b \exp\left(-\frac{|x - x_b|^2 - d^2}{2 s^2}\right), \qquad s = \max(0.01, d / 2)$$

    Cloth on the skin gets the weights under it. The hem of a skirt, as near to one leg as to the other, gets both
    legs', so that skinning does not tear it.

    Args:
        rest: The garment on the body in its rest pose [m].
        shaped: The body.
    """
    body, points = shaped.body, shaped.vertices.astype(np.float32)
    skin = np.zeros((len(points), JOINT_COUNT), np.float32)
    np.add.at(skin, (np.arange(len(points))[:, None], body.weight_indices), body.weights)
    rest = rest.astype(np.float32)
    dense = np.empty((len(rest), JOINT_COUNT), np.float32)
    for first in range(0, len(rest), 256):
        part = rest[first : first + 256]
        squared = ((part[:, None] - points[None]) ** 2).sum(axis=2)
        nearest = squared.min(axis=1, keepdims=True)
        breadth = np.maximum(MIN_BLUR, BLUR_FRACTION * np.sqrt(nearest))
        dense[first : first + 256] = np.exp((nearest - squared) / (2 * breadth**2)) @ skin
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES].astype(np.int32)
    weights = np.take_along_axis(dense, joints, axis=1)
    return SoftWeights(joints, np.ascontiguousarray(weights / weights.sum(axis=1, keepdims=True)))
