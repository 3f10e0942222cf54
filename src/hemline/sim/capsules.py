"""Capsules around the bones of arms and legs, which hold cloth off where the skin is no guide.

In a knee or an elbow that is folded far, the skin of a blend-skinned body goes through itself, and the pit of the joint
comes within millimetres of the bones: contact with the skin cannot tell the sides of the limb apart there, and a
trouser leg is pulled through it. The capsules are so thin that no cloth touches them but in such a fold.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.collide import limbs
from hemline.motions.motion import JOINT_NAMES

from .capsule_kernels import near_capsules
from .pairs import PairRows

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

BONES = tuple(
    (JOINT_NAMES.index(f"{side}_{upper}"), JOINT_NAMES.index(f"{side}_{lower}"))
    for side in ("left", "right")
    for upper, lower in (("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"))
)
"""Joints at both ends of each capsule."""

SHARE, WIDEST = 0.6, 0.025
"""Radius at a joint: so much of the way from it to the skin of the body at rest, and no more than that [m]."""

LOOK = 2.0
"""Vertices are looked for within so many radii of the axis."""

STIFFNESS = 64.0
"""How stiff a capsule is at its axis, over the body's skin; its load grows from the radius to the axis."""


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
        """As wide as the body at rest has room for."""
        from scipy.spatial import KDTree

        away, _ = KDTree(shaped.vertices).query(shaped.joints)
        radius = np.minimum(SHARE * away, WIDEST)
        return cls(radius[np.array(BONES)], limbs(shaped.body.parents)[np.array(BONES)[:, 1]])

    def rows(
        self, start: Float[np.ndarray, "verts 3"], then: Float[np.ndarray, "joints 3"],
        now: Float[np.ndarray, "joints 3"], push: Float[np.ndarray, " verts"], fixed: Bool[np.ndarray, " verts"],
        home: Int[np.ndarray, " verts"],
    ) -> PairRows:  # fmt: skip
        """What holds the vertices off that are near a bone of their own limb, on the side where they are.

        Args:
            start: The cloth at the step's start [m].
            then: The joints at the step's start [m].
            now: The joints at its end [m].
            push: Stiffness of each vertex in contact with the skin [N/m].
            fixed: Vertices without contact.
            home: Limb of each vertex.
        """
        ends = [np.ascontiguousarray(joints[np.array(BONES)], np.float64) for joints in (then, now)]
        room = 256
        while True:
            vertex, radius = np.empty(room, np.uint32), np.empty(room)
            normal, point = np.empty((room, 3)), np.empty((room, 3))
            count = near_capsules(
                start, home, fixed, *ends, self.radius, self.limb, LOOK, vertex, normal, point, radius
            )  # fmt: skip
            if count <= room:
                break
            room = count
        vertex, normal, point, radius = vertex[:count], normal[:count], point[:count], radius[:count]
        return PairRows(
            corners=np.repeat(vertex[:, None], 4, axis=1), weights=np.repeat([[1.0, 0, 0, 0]], count, axis=0),
            normal=normal, reach=np.einsum("rx,rx->r", normal, point) + radius, carried=point, thickness=radius,
            stiffness=STIFFNESS * push[vertex], limit=np.zeros(count),
        )  # fmt: skip
