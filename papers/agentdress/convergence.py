"""Fig. 9: the error over the number of anchors."""

from collections.abc import Sequence

import numpy as np

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.anchor_set import AnchorSet
from hemline.animators.agentdress.fit.fit import fit_anchors
from hemline.animators.agentdress.fit.rigged_anchors import RiggedAnchors
from hemline.arrays import Int
from hemline.datasets.joint_sensitivity import joint_weights
from hemline.garments import Garment
from hemline.motions.pose_clusters import cluster_poses
from papers.agentdress.compared import on_random_bodies
from papers.agentdress.pairs import Pair

SIZES = (2, 5, 10, 20, 40)
"""Anchors, of those that there are; then all of them."""


def curve(garment: Garment, anchors: AnchorSet, rigged: RiggedAnchors | None, pairs: Sequence[Pair]) -> dict[int, dict]:
    """Mean errors by number of anchors [mm]; poses on the mean shape alone are as many as go with them."""
    weights, found = joint_weights(anchors.sensitivity[0]), {}
    for size in (each for each in SIZES if each < len(anchors.rotations)):
        some = chosen(anchors.rotations, weights, size)
        singles = round(size * len(anchors.single_rotations) / len(anchors.rotations))
        beside = chosen(anchors.single_rotations, weights, singles) if singles else np.empty(0, int)
        fewer = anchors.subset(some, beside)
        model = fit_anchors(garment, fewer, AgentDressConfig(), progress=lambda stage, done, total: None)
        models = {}
        if rigged:
            models["rigging"] = rigged.subset(chosen(rigged.rotations, weights, min(size, len(rigged.rotations))))
        errors = on_random_bodies(model, pairs, models)
        found[size] = {name: float(np.mean(each)) for name, each in errors.items()}
    return found


def chosen(rotations: np.ndarray, weights: np.ndarray, count: int) -> Int[np.ndarray, " count"]:
    """Poses in the middle of as many clusters."""
    members = cluster_poses(rotations.astype(np.float64), weights, count).members
    return np.array([each[0] for each in members])
