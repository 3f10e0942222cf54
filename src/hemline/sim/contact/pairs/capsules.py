"""Capsules around the bones of arms and legs, which hold cloth off where the skin is a poor guide.

In a knee or an elbow that is bent far, the skin of a blend-skinned body intersects itself, and the hollow of the joint
comes within millimetres of the bones. Contact with the skin cannot tell the sides of the limb apart there, and a
trouser leg is pulled through it. The capsules are so thin that cloth touches them only in such a fold.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int, UInt

from hemline.collide import limbs
from hemline.motions.motion import JOINT_NAMES

from .capsule_kernels import CapsulePairs, MovingCapsules, near_capsules
from .pair_kernels import PairRows

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

BONES = np.array(
    [
        (JOINT_NAMES.index(f"{side}_{hinge}"), JOINT_NAMES.index(f"{side}_{end}"))
        for side in ("left", "right")
        for hinge, end in (("elbow", "shoulder"), ("elbow", "wrist"), ("knee", "hip"), ("knee", "ankle"))
    ]
)
"""Joints at both ends of each capsule, the hinge first."""

RADIUS_RATIO = 0.75
"""Maximum radius of a capsule, as a fraction of the distance from the bone to the skin of the body at rest."""

CAPSULE_STIFFNESS = 16.0
"""Stiffness of a capsule for a triangle over that of the skin for a vertex; the load grows from the radius to the axis.
"""


@dataclass(frozen=True, eq=False)
class Capsules:
    """The capsules of a body.

    Attributes:
        radius: Radii at both ends of each capsule [m].
        limb: Limb of the body that contains each capsule.
    """

    radius: Float[np.ndarray, "capsules 2"]
    limb: Int[np.ndarray, " capsules"]

    @classmethod
    def of(cls, shaped: "ShapedBody") -> "Capsules":
        """Makes capsules as wide as the body at rest has room for, and nowhere wider than at the hinge."""
        ends = shaped.joints[BONES].astype(np.float64)
        return cls(np.array([_radii(shaped.vertices, *each) for each in ends]), limbs(shaped.body.parents)[BONES[:, 0]])

    def rows(
        self,
        start: Float[np.ndarray, "verts 3"],
        faces: UInt[np.ndarray, "faces 3"],
        limb_of_face: Int[np.ndarray, " faces"],
        then: Float[np.ndarray, "joints 3"],
        now: Float[np.ndarray, "joints 3"],
        stiffness: Float[np.ndarray, " verts"],
    ) -> PairRows:
        """Returns pairs for the triangles near a bone of their own limb, which hold them on the side where they are.

        A triangle that a bone goes through is left alone, because the way out is unknown.

        Args:
            start: The cloth at the start of the step [m].
            faces: Triangles of the cloth.
            limb_of_face: Limb that each triangle lies on; -1 for no contact.
            then: The joints at the start of the step [m].
            now: The joints at the end of the step [m].
            stiffness: Stiffness of each vertex in contact with the skin [N/m].
        """
        ends = [np.ascontiguousarray(joints[BONES], np.float64) for joints in (then, now)]
        capsules, room = MovingCapsules(*ends, self.radius, self.limb), 256
        while True:
            shapes = (room, 4), (room, 3), (room, 3), room
            pairs = CapsulePairs(np.empty((room, 4), np.uint32), *(np.empty(shape) for shape in shapes))
            count = near_capsules(start, faces, limb_of_face, capsules, pairs)
            if count <= room:
                break
            room = count
        corners, weights, normal, point, radius = (each[:count] for each in pairs)
        return PairRows(
            corners=corners,
            weights=weights,
            normal=normal,
            reach=np.einsum("rx,rx->r", normal, point) + radius,
            carried=point,
            thickness=radius,
            stiffness=CAPSULE_STIFFNESS * (weights * stiffness[corners]).sum(axis=1),
            limit=np.zeros(count),
        )


def _radii(skin: np.ndarray, hinge: np.ndarray, end: np.ndarray) -> tuple[float, float]:
    """Returns the radii of a capsule at the hinge and at the other end of the bone [m]."""
    bone = end - hinge
    position = np.clip((skin - hinge) @ bone / (bone @ bone), 0, 1)
    room = RADIUS_RATIO * np.linalg.norm(skin - hinge - position[:, None] * bone, axis=1)
    lower = position > 0.5
    wide = float(room[~lower].min())
    thin = ((room[lower] - (1 - position[lower]) * wide) / position[lower]).min()
    return wide, float(np.clip(thin, 0, wide))
