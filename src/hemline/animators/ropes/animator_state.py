"""State of a garment that rope chains carry."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.ropes.bones.bone_source import BonesState
from hemline.arrays import Float, Nodes, Vertices
from hemline.learning.key_frame import to_key_frame


@dataclass(frozen=True, eq=False)
class AnimatorRopesState:
    """State of the animator; the same at all levels of detail."""

    bones: BonesState
    rest: Vertices
    """The rest drape of the full garment on this body's shape [m]."""
    rest_bones: Nodes
    """The bones in that drape [m], float64."""

    def displacements(self, bones: Nodes, key: Float[np.ndarray, "3 4"]) -> Float[np.ndarray, " ins"]:
        """Returns displacements of bones in the world from rest, in the frame of the key joint [m], float32."""
        return (to_key_frame(key, bones) - self.rest_bones).astype(np.float32).reshape(-1)
