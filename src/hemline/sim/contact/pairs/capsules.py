"""Capsules around the bones of arms and legs, which hold cloth off where the skin is no guide.

In a knee or an elbow that is folded far, the skin of a blend-skinned body goes through itself, and the pit of the joint
comes within millimetres of the bones: contact with the skin cannot tell the sides of the limb apart there, and a
trouser leg is pulled through it. The capsules are so thin that no cloth touches them but in such a fold.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int, UInt

from hemline.collide import limbs
from hemline.motions.motion import JOINT_NAMES

from .capsule_kernels import CapsulePairs, near_capsules
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
"""Joints at both ends of each capsule, the one that folds first."""

RADIUS_RATIO = 0.75
"""So much of the way from a bone to the skin of the body at rest its capsule takes up, at most."""

SEARCH_RADII = 2.0
"""Triangles are looked for within so many radii of the axis."""

CAPSULE_STIFFNESS = 16.0
"""How stiff a capsule is for a triangle, over the skin for a vertex; the load grows from the radius to the axis."""


@dataclass(frozen=True, eq=False)
class Capsules:
    """Those of a body.

    Attributes:
        radius: At both ends of each [m].
        limb: The body's limb that each is in.
    """

    radius: Float[np.ndarray, "capsules 2"]
    limb: Int[np.ndarray, " capsules"]

    @classmethod
    def of(cls, shaped: "ShapedBody") -> "Capsules":
        """As wide as the body at rest has room for, and nowhere wider than at the joint that folds."""
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
        """What holds the triangles off that are near a bone of their own limb, on the side where they are.

        A triangle that a bone goes through is let go: nobody knows which way out is.

        Args:
            start: The cloth at the step's start [m].
            faces: Its triangles.
            limb_of_face: The limb that each is worn on; -1: it has no contact.
            then: The joints at the step's start [m].
            now: The joints at its end [m].
            stiffness: Of each vertex in contact with the skin [N/m].
        """
        ends = [np.ascontiguousarray(joints[BONES], np.float64) for joints in (then, now)]
        room = 256
        while True:
            shapes = (room, 4), (room, 3), (room, 3), room
            held = CapsulePairs(np.empty((room, 4), np.uint32), *(np.empty(shape) for shape in shapes))
            count = near_capsules(start, faces, limb_of_face, *ends, self.radius, self.limb, SEARCH_RADII, held)
            if count <= room:
                break
            room = count
        corners, weights, normal, point, radius = (each[:count] for each in held)
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
    """The radii of a capsule from a hinge to the bone's other end [m]."""
    way = end - hinge
    share = np.clip((skin - hinge) @ way / (way @ way), 0, 1)
    room = RADIUS_RATIO * np.linalg.norm(skin - hinge - share[:, None] * way, axis=1)
    lower = share > 0.5
    wide = float(room[~lower].min())
    thin = ((room[lower] - (1 - share[lower]) * wide) / share[lower]).min()
    return wide, float(np.clip(thin, 0, wide))
