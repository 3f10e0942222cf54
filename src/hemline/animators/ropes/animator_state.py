"""What moves of a garment that rope chains or learned bones carry."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.ropes.bones.bone_source import BonesState
from hemline.arrays import Float, Nodes, Vertices
from hemline.learning.key_frame import to_key


@dataclass(frozen=True, eq=False)
class AnimatorRopesState:
    """All that moves; the same at all levels of detail."""

    bones: BonesState
    rest: Vertices
    """The rest drape of the full garment on this body's shape [m]."""
    rest_bones: Nodes
    """The bones in it [m], float64."""

    def displaced(self, bones: Nodes, key: Float[np.ndarray, "3 4"]) -> Float[np.ndarray, " ins"]:
        """Displacements of bones in the world from rest in the frame of the key joint [m], float32."""
        return (to_key(key, bones) - self.rest_bones).astype(np.float32).reshape(-1)
