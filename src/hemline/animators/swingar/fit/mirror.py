"""Mirrors a garment: with left and right exchanged it is another one. `FrameTensors.mirror` mirrors its frames."""

from dataclasses import replace

import numpy as np

from hemline.animators.coarse.features.columns import VECTOR
from hemline.animators.swingar.garment_sample import GarmentSample
from hemline.learning.mirror import opposite_joints


def mirror_garment(garment: GarmentSample) -> GarmentSample:
    """Returns the mirror image of a garment, with the same numbers of vertices."""
    signs = np.concatenate([VECTOR, VECTOR, [1]]).astype(np.float32)
    faces = np.ascontiguousarray(garment.faces[:, ::-1])
    logits = np.ascontiguousarray(garment.skin_logits[:, opposite_joints()])
    return replace(garment, faces=faces, features=garment.features * signs, skin_logits=logits)
