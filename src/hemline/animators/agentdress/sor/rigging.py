"""Sensitivity-optimised rigging: skin weights of settled garments that reproduce their simulated derivatives."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Self

import numpy as np

from hemline.arrays import Float, Int, Transforms
from hemline.bodies.body import PosedBody
from hemline.motions.motion import JOINT_COUNT, PARENTS
from hemline.motions.quaternions import to_matrix

from .rigging_kernels import minimize_on_simplex

MOST_BONES = 8
"""Most bones that a vertex follows."""


@dataclass(frozen=True)
class Rigging:
    r"""Settled garments with their own skin weights, which are skinned into a pose and blended.

    $$x = \sum_s w_s \sum_b w_{s,b} A_b(\theta) A_b(\theta_s)^{-1} x_s$$

    Attributes:
        transforms: Skin transforms of the anchors, on the mean shape.
        vertices: Garments of the anchors [m].
        weights: Skin weights of each garment; rows sum to 1.

    Source: Xu, Umetani, Chao, Mao, Jin, Tong, "Sensitivity-optimized rigging for example-based real-time clothing
        synthesis", 2014, after its description in Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual
        Agents using Plausible Deformations", 2021, sections 3.3 and 4.4, as the original text was not available.
        Differs: without the translation of Eq. 1, as in AgentDress, and with the derivatives of the simulator.
    """

    transforms: Float[np.ndarray, "anchors joints 3 4"]
    vertices: Float[np.ndarray, "anchors verts 3"]
    weights: Float[np.ndarray, "anchors verts joints"]

    @classmethod
    def fit(
        cls,
        posed: Sequence[PosedBody],
        vertices: Float[np.ndarray, "anchors verts 3"],
        derivatives: Iterable[Float[np.ndarray, "joints 3 verts 3"]],
        start: Float[np.ndarray, "verts joints"],
        stiffness: float,
    ) -> Self:
        """Fits the skin weights of each garment.

        Args:
            posed: The body in the pose of each anchor.
            vertices: Garments of the anchors [m].
            derivatives: Derivatives of each garment by rotations about the axes of each joint frame [m/rad].
            start: Weights to stay close to, those of the body under the garment.
            stiffness: Cost of changing the weights, relative to the cost of all joint derivatives.
        """
        weights = [
            optimize_weights(rigid_derivatives(each, garment), target, start, stiffness)
            for each, garment, target in zip(posed, vertices, derivatives, strict=True)
        ]
        return cls(np.array([each.transforms for each in posed], np.float64), vertices, np.array(weights))

    def at(self, transforms: Transforms, blend: Float[np.ndarray, "verts anchors"]) -> Float[np.ndarray, "verts 3"]:
        """Returns the garment in a pose [m].

        Args:
            transforms: Skin transforms of the pose, on the mean shape.
            blend: Weight of each anchor at each vertex (AgentDress, Eq. 8); rows sum to 1.
        """
        result = np.zeros_like(self.vertices[0])
        for anchor in np.flatnonzero(blend.any(axis=0)):
            skinned = skin_points(
                relative_transforms(transforms, self.transforms[anchor]), self.weights[anchor], self.vertices[anchor]
            )
            result += blend[:, anchor, None] * skinned
        return result


def relative_transforms(transforms: Transforms, earlier: Transforms) -> Float[np.ndarray, "joints 3 4"]:
    r"""Returns $A_b(\theta) A_b(\theta_s)^{-1}$ for each bone, where all transforms are rigid."""
    rotations = np.einsum("bij,bkj->bik", transforms[:, :, :3].astype(np.float64), earlier[:, :, :3])
    shift = transforms[:, :, 3] - np.einsum("bij,bj->bi", rotations, earlier[:, :, 3])
    return np.concatenate([rotations, shift[:, :, None]], axis=2)


def skin_points(
    transforms: Float[np.ndarray, "joints 3 4"],
    weights: Float[np.ndarray, "verts joints"],
    points: Float[np.ndarray, "verts 3"],
) -> Float[np.ndarray, "verts 3"]:
    """Skins points with the weights of all bones [m]."""
    blended = np.einsum("vb,bij->vij", weights, transforms)
    return np.einsum("vij,vj->vi", blended[:, :, :3], points) + blended[:, :, 3]


def rigid_derivatives(
    posed: PosedBody, vertices: Float[np.ndarray, "verts 3"]
) -> Float[np.ndarray, "joints 3 verts 3"]:
    r"""Returns derivatives of points that follow a joint $j$ rigidly, by its rotation about each of its axes [m/rad].

    $$\omega_a \times (x - x_j)$$

    $\omega_a$ is axis $a$ of the joint in the world, $x_j$ its position, and $x$ a vertex.
    """
    axes = np.einsum(
        "jik,jlk->jil",
        posed.transforms[:, :, :3].astype(np.float64),
        to_matrix(posed.shaped.body.rest_offsets.astype(np.float64)),
    )
    relative = vertices[None] - posed.joints[:, None].astype(np.float64)
    return np.cross(axes.transpose(0, 2, 1)[:, :, None, :], relative[:, None])


def optimize_weights(
    turns: Float[np.ndarray, "joints 3 verts 3"],
    derivatives: Float[np.ndarray, "joints 3 verts 3"],
    start: Float[np.ndarray, "verts joints"],
    stiffness: float,
) -> Float[np.ndarray, "verts joints"]:
    r"""Finds the skin weights whose derivatives are closest to those of the simulation.

    $$\min_{w \ge 0, \sum w = 1} \sum_{j,a} |S_{ja} - (\sum_{b \in j} w_b)\, v_{ja}|^2 + \lambda |w - w_0|^2$$

    where b runs over the bones moved by joint j. Solved exactly by active sets, then again for the 8 largest weights.

    Args:
        turns: $v_{ja}$, see `rigid_derivatives` [m/rad].
        derivatives: $S_{ja}$ of the simulation [m/rad].
        start: $w_0$.
        stiffness: $\lambda$, over the sum of $|v|^2$ at each vertex.
    """
    products = np.einsum("javi,javi->vj", turns, derivatives)
    squares = np.einsum("javi,javi->vj", turns, turns)
    scale = stiffness * squares.sum(axis=1)
    linear = products @ _descendants() + scale[:, None] * start
    weights, allowed = start.astype(np.float64), np.ones(start.shape, bool)
    minimize_on_simplex(squares, linear, scale, *_tree(), allowed, weights)
    allowed[:] = False
    np.put_along_axis(allowed, np.argsort(-weights, axis=1)[:, :MOST_BONES], True, axis=1)
    weights = np.where(allowed, weights, 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    minimize_on_simplex(squares, linear, scale, *_tree(), allowed, weights)
    return weights


@cache
def _tree() -> tuple[Int[np.ndarray, " joints"], Int[np.ndarray, "joints joints"]]:
    """Returns the parent of each joint, and the last common ancestor of each pair of bones."""
    both = _descendants()[:, :, None] * _descendants()[:, None, :]
    return np.array(PARENTS), JOINT_COUNT - 1 - both[::-1].argmax(axis=0)


def _descendants() -> Float[np.ndarray, "joints joints"]:
    """Returns a matrix that is 1 where the joint of the row moves the bone of the column."""
    result = np.eye(JOINT_COUNT)
    for bone in range(JOINT_COUNT):
        joint = PARENTS[bone]
        while joint >= 0:
            result[joint, bone] = 1.0
            joint = PARENTS[joint]
    return result
