"""A rig posed in each frame of a clip, in the file's own axes."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from hemline.motions.bvh import Bvh, BvhSkeleton
from hemline.motions.quaternions import Vector, inverse, rotate

from .names import JointMatch
from .posing import pose_joints


@dataclass(frozen=True, eq=False)
class Rig:
    """A rig in the zero pose and in each frame, in the file's unit and axes.

    Attributes:
        skeleton: Hierarchy of the rig, as in the file.
        match: Joints of the rig by role.
        zero: Joint positions in the zero pose.
        ends: Offset of the End Site of leaf joints in the zero pose.
        rotations: Global rotation of each joint in each frame; identity is the zero pose.
        positions: Joint positions in each frame.
    """

    skeleton: BvhSkeleton
    match: JointMatch
    zero: Float[np.ndarray, "joints 3"]
    ends: Mapping[int, np.ndarray]
    rotations: Float[np.ndarray, "frames joints 4"]
    positions: Float[np.ndarray, "frames joints 3"]

    def __len__(self) -> int:
        return len(self.rotations)

    def cut(self, frames: slice) -> "Rig":
        """Returns the rig in some of its frames."""
        return replace(self, rotations=self.rotations[frames], positions=self.positions[frames])

    def sample(self, most: int) -> "Rig":
        """Returns the rig in at most so many frames, evenly spread over the clip."""
        return self.cut(slice(None, None, -(-len(self) // most)))

    def index(self, joint: str) -> int:
        """Returns the index of the joint of a role."""
        return self.match.joints[joint]

    def path(self, joint: str) -> Float[np.ndarray, "frames 3"]:
        """Returns the position of the joint of a role in each frame."""
        return self.positions[:, self.match.joints[joint]]

    def bone(self, joint: str, child: str) -> Vector:
        """Returns the vector from one joint to another in the zero pose."""
        return self.zero[self.match.joints[child]] - self.zero[self.match.joints[joint]]

    def leg_length(self) -> float:
        """Returns the mean length from hip to knee to ankle [file's unit]."""
        bones = [
            self.bone(f"{side}_{start}", f"{side}_{end}")
            for side in ("left", "right")
            for start, end in (("hip", "knee"), ("knee", "ankle"))
        ]
        return float(np.linalg.norm(bones, axis=1).sum()) / 2

    def tip(self, joint: int) -> Vector | None:
        """Returns the vector from a joint to its middle or index finger, first child but the thumb, or End Site."""
        best = self._longest_finger(joint)
        return self.ends.get(joint) if best is None else self.zero[best] - self.zero[joint]

    def sole(self, side: str) -> Vector | None:
        """Returns the vector from an ankle to the ball of the foot, or to the tip of toes that begin beneath the ankle.

        It is that of the zero pose; None if the foot ends in the ankle.
        """
        ankle = self.match.joints[f"{side}_ankle"]
        sole, toes = self.tip(ankle), self._longest_finger(ankle)
        tip = None if toes is None else self.tip(toes)
        if sole is not None and tip is not None and np.linalg.norm(sole) < 0.5 * np.linalg.norm(tip):
            sole = sole + tip
        return None if sole is None or not np.linalg.norm(sole) > 0 else sole

    def _longest_finger(self, joint: int) -> int | None:
        """Returns the middle or index finger of a hand, or the first child but the thumb."""
        names = {child: self.skeleton.names[child].lower() for child in self._children(joint)}
        fingers = [child for child in names if "thumb" not in names[child]]
        return next((child for finger in ("mid", "index", "") for child in fingers if finger in names[child]), None)

    def _children(self, joint: int) -> list[int]:
        return [child for child, parent in enumerate(self.skeleton.parents) if parent == joint]

    def mean_in(self, joint: int, vectors: Float[np.ndarray, "frames 3"]) -> Vector:
        """Returns the mean of moving vectors in a joint's own frame."""
        return rotate(inverse(self.rotations[:, joint]), vectors).mean(axis=0)

    def mean_direction(self, joint: int, points: Float[np.ndarray, "frames 3"]) -> Vector:
        """Returns the mean direction from a joint to moving points, in the joint's own frame."""
        away = points - self.positions[:, joint]
        return self.mean_in(joint, away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-12))

    def zero_tip(self, joint: int) -> Vector:
        """Returns the position of a joint's tip in the zero pose; the joint itself where it has none."""
        tip = self.tip(joint)
        return self.zero[joint] + (np.zeros(3) if tip is None else tip)

    def tip_path(self, joint: int) -> Float[np.ndarray, "frames 3"]:
        """Returns the position of that tip in each frame."""
        return self.positions[:, joint] + rotate(self.rotations[:, joint], self.zero_tip(joint) - self.zero[joint])


def pose_rig(bvh: Bvh, match: JointMatch) -> Rig:
    """Poses a rig in all frames. Bones below the pelvis keep their length, whatever their channels say."""
    skeleton = bvh.skeleton
    rotations, positions = pose_joints(bvh, match.carriers)
    return Rig(skeleton, match, skeleton.zero_positions, skeleton.ends, rotations, positions)
