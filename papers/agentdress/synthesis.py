r"""The equations of AgentDress in plain NumPy, one function each: read this file first.

Nothing here is fast, and nothing differs from the paper except where a docstring says so. `models/paper_system.py` puts
the functions together to the system of the paper, which stands in every table of errors beside ours.

Notation: $f(\beta, \theta)$ is the garment on a body of shape $\beta$ in pose $\theta$. $\beta_0$ is the mean shape and
$\theta_s$ the pose of anchor $s$. Distances are in metres and angles in radians.

Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021.
"""

import numpy as np

from hemline.arrays import Float, Int, Transforms
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import inverse, multiply, to_axis_angle

Points = Float[np.ndarray, "verts 3"]

MARGIN = 0.005
r"""$\epsilon_p$, the largest distance that penetration handling restores [m] (section 3.5.2)."""

NEIGHBOURS, POWER = 5, 3.0
"""Number of anchors that are blended in each region, and exponent $k$ of their distances (section 3.4)."""

SMALL = 1e-6
r"""$\epsilon$ of the blend weights, over the median distance between anchors. The paper calls it a small number."""


def expand_to_first_order(
    garment: Points,
    by_shape: Float[np.ndarray, "betas verts 3"],
    by_pose: Float[np.ndarray, "angles verts 3"],
    betas: Float[np.ndarray, " betas"],
    angles: Float[np.ndarray, " angles"],
) -> Points:
    r"""Returns $f(\beta_0, \theta_0) + \Delta\beta f_\beta + \Delta\theta f_\theta$.

    Args:
        garment: The garment of an anchor, on the mean body [m].
        by_shape: Its derivative by each beta [m].
        by_pose: Its derivative by each joint angle [m/rad].
        betas: Shape of the body.
        angles: Joint angles from the anchor to the pose, see `joint_angles` [rad].

    Source: Eq. 1.
    """
    return garment + np.einsum("b,bvi->vi", betas, by_shape) + np.einsum("m,mvi->vi", angles, by_pose)


def expand_by_differences(posed: Points, shaped: Points, origin: Points) -> Points:
    r"""Returns $f(\beta_0, \theta) + f(\beta, \theta_0) - f(\beta_0, \theta_0)$ [m].

    Args:
        posed: The garment on the mean body in the pose [m].
        shaped: The garment on the body in the pose of the anchor [m].
        origin: The garment on the mean body in the pose of the anchor [m].

    Source: Eq. 2.
    """
    return posed + (shaped - origin)


def expand_with_skinning(posed: Points, shaped: Points, origin: Points) -> Points:
    r"""Returns $f(\beta_0, \theta) + (LBS(f(\beta, \theta_0)) - LBS(f(\beta_0, \theta_0)))$ [m].

    Args:
        posed: The garment on the mean body in the pose [m].
        shaped: The garment on the body in the pose of the anchor, skinned from there into the pose [m].
        origin: The same of the mean body [m].

    Source: Eq. 3, which is Eq. 2 for garments that were skinned.
    """
    return expand_by_differences(posed, shaped, origin)


def blend_expansions(
    posed: Points,
    shaped: Float[np.ndarray, "anchors verts 3"],
    origins: Float[np.ndarray, "anchors verts 3"],
    weights: Float[np.ndarray, "verts anchors"],
) -> Points:
    r"""Returns the garment on a body in a pose [m].

    $$f(\beta_0, \theta) + \sum_s w^s LBS_s(f(\beta, \theta_s)) - \sum_s w^s LBS_s(f(\beta_0, \theta_s))$$

    Args:
        posed: The garment on the mean body in the pose, from a clothing pose model [m].
        shaped: The garment of each anchor on the body, skinned into the pose [m].
        origins: The same of the mean body [m].
        weights: Weight of each anchor at each vertex, see `vertex_weights`.

    Source: Eq. 4.
    """
    return posed + np.einsum("va,avi->vi", weights, shaped) - np.einsum("va,avi->vi", weights, origins)


def bind_to_skin(garment: Points, posed: PosedBody) -> Int[np.ndarray, " verts"]:
    """Returns the closest body vertex of each garment vertex, whose bone weights it takes.

    Source: section 3.4, the binding information updating step.
    """
    from scipy.spatial import KDTree

    return np.asarray(KDTree(posed.vertices).query(garment)[1], np.int64)


def bone_weights(shaped: ShapedBody, closest: Int[np.ndarray, " verts"]) -> Float[np.ndarray, "verts joints"]:
    """Returns the weight of each bone at the closest body vertex of each garment vertex."""
    body, weights = shaped.body, np.zeros((len(closest), JOINT_COUNT))
    np.add.at(weights, (np.arange(len(closest))[:, None], body.weight_indices[closest]), body.weights[closest])
    return weights


def skin_from_pose(
    garment: Points, weights: Float[np.ndarray, "verts joints"], earlier: Transforms, transforms: Transforms
) -> Points:
    r"""Returns $\sum_b w_b (R_b y + T_b)$, a garment skinned from one pose into another [m].

    Args:
        garment: The garment in the first pose [m].
        weights: Weight of each bone at each vertex.
        earlier: Skin transforms of the first pose (joints, 3, 4).
        transforms: Skin transforms of the second pose (joints, 3, 4).

    Source: section 3.4. $R_b$ and $T_b$ move bone b from the pose of the anchor to the queried one.
    """
    first, second = (_square(each) for each in (earlier, transforms))
    relative = second @ np.linalg.inv(first)
    blended = np.tensordot(weights, relative, 1)
    return np.einsum("vij,vj->vi", blended[:, :3, :3], garment) + blended[:, :3, 3]


def _square(transforms: Transforms) -> Float[np.ndarray, "joints 4 4"]:
    """Returns transforms with their last row."""
    full = np.tile(np.eye(4), (len(transforms), 1, 1))
    full[:, :3] = transforms
    return full


def joint_angles(
    rotations: Float[np.ndarray, "... joints 4"], anchor: Float[np.ndarray, "... joints 4"]
) -> Float[np.ndarray, "... joints 3"]:
    r"""Returns $\Theta_m(\theta, \theta_s)$, the rotation of each joint from an anchor to a pose about its axes [rad].

    Args:
        rotations: Local rotations of the joints in the pose, without heading, as unit quaternions wxyz.
        anchor: The same of the anchor.

    Source: Eq. 7. The paper does not name its joint angles; these are the components of the rotation vector.
    """
    return to_axis_angle(multiply(inverse(anchor.astype(np.float64)), rotations.astype(np.float64)))


def joint_influence(
    regions: Float[np.ndarray, "verts regions"], sensitivity: Float[np.ndarray, "verts joints 3"]
) -> Float[np.ndarray, "regions joints 3"]:
    r"""Returns $Q_{g,m} = \sum_y w_{g,y} |\bar\delta_{y,m}|^2$, the influence of each joint angle on each region.

    Args:
        regions: Weight of each region at each vertex.
        sensitivity: $\bar\delta_{y,m}$, the mean over the training shapes of the motion of a vertex by a joint angle in
            the T-pose [m/rad].

    Source: Eq. 7.
    """
    return np.einsum("vg,vjm->gjm", regions, sensitivity**2)


def pose_distances(
    influence: Float[np.ndarray, "regions joints 3"], angles: Float[np.ndarray, "anchors joints 3"]
) -> Float[np.ndarray, "regions anchors"]:
    r"""Returns $D_g^s(\theta) = \sum_m Q_{g,m} |\Theta_m(\theta, \theta_s)|^2$ [m^2].

    Source: Eq. 7.
    """
    return np.einsum("gjm,sjm->gs", influence, angles**2)


def blend_weights(
    distances: Float[np.ndarray, "regions anchors"], scale: Float[np.ndarray, " regions"]
) -> Float[np.ndarray, "regions anchors"]:
    r"""Returns $W_g^s / \sum_s W_g^s$ with $W_g^s = 1 / (D_g^s + \epsilon)^k$ for the five nearest anchors, else 0.

    Args:
        distances: Distance to each anchor, see `pose_distances`.
        scale: Median distance between anchors in each region, which $\epsilon$ is a fraction of.

    Source: section 3.4 and Eq. 8.
    """
    # a region that the garment does not have is at no distance from any anchor, and has no vertex to weight
    floored = distances + np.maximum(SMALL * scale[:, None], np.finfo(np.float64).tiny)
    nearest = np.argsort(distances, axis=1, kind="stable")[:, :NEIGHBOURS]
    weights = np.zeros_like(distances)
    rows = np.arange(len(distances))[:, None]
    weights[rows, nearest] = (floored[rows, nearest[:, :1]] / floored[rows, nearest]) ** POWER
    return weights / weights.sum(axis=1, keepdims=True)


def vertex_weights(
    regions: Float[np.ndarray, "verts regions"], weights: Float[np.ndarray, "regions anchors"]
) -> Float[np.ndarray, "verts anchors"]:
    r"""Returns $w^s = \sum_g w_g W_g^s / \sum_s W_g^s$, the weight of each anchor at each vertex.

    Source: Eq. 8.
    """
    return regions @ weights


def decay_distances(
    distances: Float[np.ndarray, "regions anchors"], before: Float[np.ndarray, "regions anchors"], damping: float
) -> Float[np.ndarray, "regions anchors"]:
    r"""Returns $\eta D' + (1 - \eta) D$, where $D'$ are the distances of the frame before.

    Source: Eq. 9.
    """
    return damping * before + (1 - damping) * distances


def clearances(garment: Points, posed: PosedBody) -> Float[np.ndarray, " verts"]:
    r"""Returns $h = n \cdot (y - c)$, where c is the closest body vertex of a garment vertex y and n its normal [m].

    Source: section 3.5.2.
    """
    closest = bind_to_skin(garment, posed)
    return np.einsum("vi,vi->v", posed.normals[closest], garment - posed.vertices[closest])


def push_out_of_body(garment: Points, posed: PosedBody) -> Points:
    """Moves vertices out of the body along the normal of their closest body vertex [m].

    Source: section 3.2, for the output of a clothing shape model. One push per vertex, where the paper repeats it until
        no vertex is inside.
    """
    closest = bind_to_skin(garment, posed)
    depth = np.minimum(clearances(garment, posed), 0.0)
    return garment - depth[:, None] * posed.normals[closest]


def restore_clearances(
    garment: Points,
    initial: Float[np.ndarray, "anchors verts"],
    weights: Float[np.ndarray, "verts anchors"],
    posed: PosedBody,
) -> Points:
    r"""Returns $\sum_s w^s (y + \max(0, \min(h_0^s, \epsilon_p) - h) n)$ [m].

    Args:
        garment: The garment that Eq. 4 returns [m].
        initial: Clearance $h_0^s$ of each vertex in each anchor, on the body of the query [m].
        weights: Weight of each anchor at each vertex.
        posed: The body in the pose.

    Source: Eq. 10.
    """
    closest = bind_to_skin(garment, posed)
    height = np.einsum("vi,vi->v", posed.normals[closest], garment - posed.vertices[closest])
    push = np.maximum(np.minimum(initial, MARGIN) - height, 0.0)
    return garment + np.einsum("va,av->v", weights, push)[:, None] * posed.normals[closest]
