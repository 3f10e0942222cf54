"""Pose models beside the one that ships, each from the same anchors: offsets on the mean shape in a given pose."""

from collections.abc import Callable

import numpy as np

from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.rigged_anchors import anchor_blend
from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.arrays import Float
from hemline.motions.motion import Pose
from hemline.motions.quaternions import to_matrix

Offsets = Float[np.ndarray, "verts 3"]
PoseModel = Callable[[Pose], Offsets]
"""From a pose, arms lifted as in anchors, to what is added to skinning on the mean shape [m]."""

RIDGES = (1e-2, 1e-1, 1.0, 10.0, 100.0)


def blended(model: AnimatorAgentDress, anchors: AnchorSet) -> PoseModel:
    """The nearest anchors, skinned and blended."""
    offsets = anchors.offsets[:, 0].astype(np.float64)
    return lambda pose: np.einsum("va,avi->vi", anchor_blend(model, anchors.rotations, pose), offsets)


def nearest(model: AnimatorAgentDress, anchors: AnchorSet) -> PoseModel:
    """The nearest anchor alone, skinned."""
    offsets = anchors.offsets[:, 0].astype(np.float64)
    return lambda pose: offsets[anchor_blend(model, anchors.rotations, pose).mean(axis=0).argmax()]


def ridge(anchors: AnchorSet) -> PoseModel:
    """The plain baseline: ridge regression from the rotations of the joints; its penalty by leaving one out."""
    rotations = np.concatenate([anchors.rotations, anchors.single_rotations])
    outputs = np.concatenate([anchors.offsets[:, 0], anchors.single_offsets]).reshape(len(rotations), -1)
    inputs = _entries(rotations)
    centre, mean = inputs.mean(axis=0), outputs.mean(axis=0)
    gram = (inputs - centre) @ (inputs - centre).T
    duals = []
    for penalty in RIDGES:
        inverse = np.linalg.inv(gram + penalty * np.eye(len(gram)))
        dual = inverse @ (outputs - mean)
        duals.append((float(np.square(dual / np.diag(inverse)[:, None]).mean()), dual))
    weights = (inputs - centre).T @ min(duals, key=lambda each: each[0])[1]
    return lambda pose: (mean + (_entries(pose.rotations[None])[0] - centre) @ weights).reshape(-1, 3)


def _entries(rotations: Float[np.ndarray, "poses joints 4"]) -> Float[np.ndarray, "poses entries"]:
    return to_matrix(rotations.astype(np.float64)).reshape(len(rotations), -1)
