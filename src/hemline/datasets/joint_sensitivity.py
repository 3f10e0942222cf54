"""Sensitivity of a garment to each joint: from derivatives of settled garments to weights of joints."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import Float
from hemline.bodies.body import Body
from hemline.errors import BadDataset
from hemline.motions.motion import JOINT_COUNT

from .take import Take

MOST_LEVERS, LEAST_LEVER_M = 1.5, 0.05
"""Largest derivative of a vertex by a rotation, over its distance from the joint, and least distance that counts [m].

Cloth that rides on a joint moves by its distance from it. Where an equilibrium is about to give way, as in a crease or
a fold, its derivative has no bound, and a few such vertices would outweigh all others.
"""


def mean_sensitivity(takes: Sequence[Take], body: Body) -> Float[np.ndarray, "verts joints 3"]:
    r"""Returns $\bar\delta_{y,m} = \frac{1}{n} \sum_k |\delta^k_{y,m}|$, the motion of vertices by joints [m/rad].

    Args:
        takes: Anchors in the T-pose, one for each shape, with derivatives by all joints.
        body: The body that they were settled on.

    Raises:
        BadDataset: No take has derivatives, or one lacks some.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 7: the mean over shapes of the norms, not the norm of the mean. Differs: derivatives are bounded.
    """
    found = [derivatives_by_joint(take, body) for take in takes if "turn.0.0" in take.derivatives]
    if not found:
        raise BadDataset("no anchor in the T-pose with derivatives", "none", "run 'hemline drape --anchors' again")
    return np.mean([np.linalg.norm(each, axis=3) for each in found], axis=0).transpose(2, 0, 1)


def derivatives_by_joint(take: Take, body: Body) -> Float[np.ndarray, "joints 3 verts 3"]:
    """Returns the derivatives of an anchor by turns of each joint about its three axes, bounded by the lever [m/rad].

    Args:
        take: The anchor.
        body: The body that it was settled on.

    Raises:
        BadDataset: The anchor lacks some of them.
    """
    names = [[f"turn.{joint}.{axis}" for axis in range(3)] for joint in range(JOINT_COUNT)]
    missing = [name for axes in names for name in axes if name not in take.derivatives]
    if missing:
        raise BadDataset(f"anchor {take.name} lacks derivatives by joints", f"no {missing[0]}", "make it again")
    found = np.stack([[take.derivatives[name] for name in axes] for axes in names]).astype(np.float64)
    joints = body.shaped(take.betas).posed(take.motion[0]).joints
    levers = np.linalg.norm(take.vertices[0] - joints[:, None], axis=2)[:, None]
    most = MOST_LEVERS * np.maximum(levers, LEAST_LEVER_M)
    sizes = np.linalg.norm(found, axis=3)
    return found * np.minimum(1.0, most / np.maximum(sizes, most))[..., None]


def joint_weights(sensitivity: Float[np.ndarray, "verts joints 3"]) -> Float[np.ndarray, " joints"]:
    r"""Returns $s^L = \sum_y \sum_m \bar\delta_{y,m}$ of each joint, divided by the largest.

    Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
        Eq. 11. Differs: the pelvis counts no more than the next joint of the spine. It carries all of the garment
        and would dominate the other joints, and poses are compared without its heading.
    """
    weights = sensitivity.sum(axis=(0, 2))
    weights[0] = min(weights[0], weights[3])
    return weights / weights.max()
