"""Pose-dependent offsets of the skin at rest, which SMPL adds before skinning."""

import numpy as np
from jaxtyping import Float

from hemline.arrays import Quaternions, Vertices
from hemline.motions.quaternions import to_matrix


def pose_offsets(posedirs: Float[np.ndarray, "features verts 3"], rotations: Quaternions) -> Vertices:
    r"""Returns the offset at rest of each vertex in a pose.

    $$\sum_{j=1}^{23} \sum_{k=1}^{9} P_{jk} \, (R_j - I)_k$$

    The entries of the local rotations $R_j$ are taken row by row. The offsets vanish in the T-pose.

    Args:
        posedirs: `Body.posedirs`, nine for each joint but the pelvis, of all or some vertices [m].
        rotations: Local rotation of each joint, as `Pose.rotations`.

    Returns:
        Offsets, float32 [m].

    Source: Loper et al., "SMPL: A skinned multi-person linear model", 2015, Eq. 9.
    """
    matrices = to_matrix(rotations[1:].astype(np.float64))
    features = (matrices - np.eye(3)).reshape(-1).astype(np.float32)
    return np.einsum("f,fvc->vc", features, posedirs)


def pose_offsets_turning(
    posedirs: Float[np.ndarray, "features verts 3"],
    rotations: Quaternions,
    joint: int,
    axis: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "verts 3"]:
    r"""Returns the velocity of these offsets while a joint turns about an axis of its frame: $\dot R = R [a]_\times$.

    Args:
        posedirs: As for `pose_offsets` [m].
        rotations: Local rotation of each joint.
        joint: Number of the joint.
        axis: Axis in the joint's frame; its length is the speed [rad/s].

    Returns:
        Velocities at rest, float64 [m/s].
    """
    if joint == 0:
        return np.zeros(posedirs.shape[1:])
    spin = np.cross(np.eye(3), np.asarray(axis, np.float64))  # [a]x
    rate = (to_matrix(rotations[joint].astype(np.float64)) @ spin).reshape(-1)
    return np.einsum("f,fvc->vc", rate, posedirs[9 * joint - 9 : 9 * joint].astype(np.float64))
