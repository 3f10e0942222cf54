"""Regions of a garment: each has its own nearest anchors, so that an arm does not choose for a leg."""

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
"""Bones of each region. One list serves tops and trousers: a region that a garment does not reach has no weight.

Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations", 2021,
    section 3.4 and Fig. 4, seven regions by hand. Differs: ten, of which a shirt uses seven or eight.
"""

LEAST_REGION_FRACTION = 0.01
"""A region with less than this share of the garment is left out."""


def region_weights(binding: Binding) -> Float[np.ndarray, "verts regions"]:
    r"""$w_{g,y}$: the share of each region in each vertex, by its bones; regions that hardly touch the garment are left
    out, and what remains sums to 1.
    """
    of_bone = np.zeros((JOINT_COUNT, len(REGIONS)))
    for region, names in enumerate(REGIONS):
        of_bone[[JOINT_NAMES.index(name) for name in names], region] = 1.0
    shares = binding.dense_weights() @ of_bone
    shares = shares[:, shares.mean(axis=0) >= LEAST_REGION_FRACTION]
    total = shares.sum(axis=1, keepdims=True)
    return np.where(total > 1e-6, shares / np.maximum(total, 1e-6), 1.0 / shares.shape[1])
