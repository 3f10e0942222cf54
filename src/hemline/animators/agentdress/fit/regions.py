"""Regions of a garment, each with its own distances to the anchors, so that arms do not affect legs."""

import numpy as np

from hemline.animators.agentdress.binding import Binding
from hemline.arrays import Float
from hemline.motions.motion import JOINT_COUNT, JOINT_NAMES

REGIONS = (
    ("spine1", "spine2", "spine3", "neck", "head", "left_collar", "right_collar"),
    ("left_shoulder",),
    ("right_shoulder",),
    ("left_elbow", "left_wrist", "left_hand"),
    ("right_elbow", "right_wrist", "right_hand"),
    ("pelvis",),
    ("left_hip",),
    ("right_hip",),
    ("left_knee", "left_ankle", "left_foot"),
    ("right_knee", "right_ankle", "right_foot"),
)
"""Bones of each region, for tops and trousers alike: a region outside a garment has no weight.

Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
    section 3.4 and Fig. 4, with seven hand-made regions. Differs: ten regions, of which a shirt uses seven or eight.
"""

LEAST_REGION_FRACTION = 0.01
"""A region with less than this fraction of the garment is dropped."""


def region_weights(binding: Binding) -> Float[np.ndarray, "verts regions"]:
    r"""Returns $w_{g,y}$, the weight of each region at each vertex, from its bones; rows sum to 1.

    Regions that hardly touch the garment are dropped.
    """
    membership = np.zeros((JOINT_COUNT, len(REGIONS)))
    for region, names in enumerate(REGIONS):
        membership[[JOINT_NAMES.index(name) for name in names], region] = 1.0
    weights = binding.dense_weights() @ membership
    weights = weights[:, weights.mean(axis=0) >= LEAST_REGION_FRACTION]
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 1e-6, weights / np.maximum(total, 1e-6), 1.0 / weights.shape[1])
