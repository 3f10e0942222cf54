"""Derivatives of linear blend skinning: velocity of the skin when a joint turns or the shape changes."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from hemline.motions.quaternions import to_matrix

from .pose_offsets import pose_offsets_turning

if TYPE_CHECKING:
    from .body import PosedBody


def turning_velocity(posed: "PosedBody", joint: int, axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "verts 3"]:
    r"""Returns the velocity of the skin while a joint turns about an axis of its own frame: R(t) = R exp(t axis).

    $$\dot v = \sum_k w_k\, \omega \times (A_k \bar v - x_j), \qquad \omega = G_j a$$

    summed over the joint j and all joints k behind it. Pose-dependent offsets are part of $\bar v$, and their change is
    added.

    Args:
        posed: The body; its skin must be blended linearly.
        joint: Number of the joint.
        axis: Axis in the joint's frame; its length is the speed [rad/s].

    Returns:
        Velocities, float64 [m/s].
    """
    body, transforms = posed.shaped.body, posed.transforms.astype(np.float64)
    behind = _behind(body.parents, joint)
    weights = np.where(behind[body.weight_indices], body.weights, 0.0).astype(np.float64)
    rest = posed.rest_vertices.astype(np.float64)
    blended = np.zeros_like(rest)
    for influence in range(weights.shape[1]):
        used = np.flatnonzero(weights[:, influence])
        each = transforms[body.weight_indices[used, influence]]
        points = np.einsum("vij,vj->vi", each[:, :, :3], rest[used]) + each[:, :, 3]
        blended[used] += weights[used, influence, None] * points
    offset = to_matrix(body.rest_offsets[joint].astype(np.float64))
    omega = transforms[joint, :, :3] @ offset.T @ np.asarray(axis, np.float64)
    spun = np.cross(omega, blended - weights.sum(axis=1, keepdims=True) * posed.joints[joint].astype(np.float64))
    if body.posedirs is None:
        return spun
    return spun + _rotate_with_skin(posed, pose_offsets_turning(body.posedirs, posed.pose.rotations, joint, axis))


def reshaping_velocity(posed: "PosedBody", beta: int) -> Float[np.ndarray, "verts 3"]:
    """Returns the velocity of the skin while a shape coefficient grows by one a second, in the same pose.

    Args:
        posed: The body; its skin must be blended linearly.
        beta: Number of the coefficient.

    Returns:
        Velocities, float64 [m/s].
    """
    body, matrices = posed.shaped.body, posed.transforms[:, :, :3].astype(np.float64)
    skin, joints = body.shapedirs[beta].astype(np.float64), body.joint_shapedirs[beta].astype(np.float64)
    at = np.zeros_like(joints)
    for joint in range(1, len(joints)):
        parent = body.parents[joint]
        at[joint] = at[parent] + matrices[parent] @ (joints[joint] - joints[parent])
    shift = at - np.einsum("jik,jk->ji", matrices, joints)
    result = np.zeros_like(skin)
    for influence in range(body.weights.shape[1]):
        index, weight = body.weight_indices[:, influence], body.weights[:, influence, None].astype(np.float64)
        result += weight * (np.einsum("vij,vj->vi", matrices[index], skin) + shift[index])
    return result


def _rotate_with_skin(posed: "PosedBody", directions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "verts 3"]:
    """Turns directions at rest as the skin is turned."""
    body, result = posed.shaped.body, np.zeros_like(directions)
    for influence in range(body.weights.shape[1]):
        matrices = posed.transforms[body.weight_indices[:, influence], :, :3].astype(np.float64)
        result += body.weights[:, influence, None] * np.einsum("vij,vj->vi", matrices, directions)
    return result


def _behind(parents: np.ndarray, joint: int) -> Bool[np.ndarray, " joints"]:
    """Returns a mask of a joint and all joints that hang on it."""
    result = np.zeros(len(parents), bool)
    result[joint] = True
    for each in range(joint + 1, len(parents)):
        result[each] = result[parents[each]]
    return result
