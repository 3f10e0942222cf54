"""A rig with y up, posed in each frame of a clip."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hemline.motions.bvh import Bvh, BvhSkeleton
from hemline.motions.quaternions import Quaternion, Vector, angle, from_matrix, inverse, multiply, rotate

from .names import JointMatch


@dataclass(frozen=True, eq=False)
class Rig:
    """A rig with y up whose zero pose faces +z, in the file's unit.

    Attributes:
        skeleton: Hierarchy of the rig, as in the file.
        match: Joints of the rig by role.
        zero: Joint positions in the zero pose.
        ends: Offset of the End Site of leaf joints in the zero pose.
        rotations: Global rotation of each joint in each frame; identity is the zero pose.
        positions: Joint positions in each frame.
        note: A sentence that says how the rig was turned, if it was.
    """

    skeleton: BvhSkeleton
    match: JointMatch
    zero: Float[np.ndarray, "joints 3"]
    ends: dict[int, np.ndarray]
    rotations: Float[np.ndarray, "frames joints 4"]
    positions: Float[np.ndarray, "frames joints 3"]
    note: str

    def bone(self, joint: str, child: str) -> Vector:
        """Returns the vector from one joint to another in the zero pose."""
        return self.zero[self.match.joints[child]] - self.zero[self.match.joints[joint]]

    def tip(self, joint: int) -> Vector | None:
        """Returns the vector from a joint to its middle or index finger, first child but the thumb, or End Site."""
        names = {child: self.skeleton.names[child].lower() for child in self._children(joint)}
        fingers = [child for child in names if "thumb" not in names[child]]
        if not fingers:
            return self.ends.get(joint)
        best = next(child for finger in ("mid", "index", "") for child in fingers if finger in names[child])
        return self.zero[best] - self.zero[joint]

    def _children(self, joint: int) -> list[int]:
        return [child for child, parent in enumerate(self.skeleton.parents) if parent == joint]

    def mean_direction(self, joint: str, points: Float[np.ndarray, "frames 3"]) -> Vector:
        """Returns the mean direction from a joint to moving points, in the joint's own frame."""
        index = self.match.joints[joint]
        away = rotate(inverse(self.rotations[:, index]), points - self.positions[:, index])
        return (away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-12)).mean(axis=0)

    def zero_tip(self, joint: int) -> Vector:
        """Where the tip of a joint is in the zero pose; the joint itself where it has none."""
        tip = self.tip(joint)
        return self.zero[joint] + (np.zeros(3) if tip is None else tip)

    def tip_path(self, joint: int) -> Float[np.ndarray, "frames 3"]:
        """Where that is in each frame."""
        return self.positions[:, joint] + rotate(self.rotations[:, joint], self.zero_tip(joint) - self.zero[joint])


def turn_upright(bvh: Bvh, match: JointMatch, start: int) -> Rig:
    """Turn a rig by quarter turns so that its zero pose has y up and its left along +x, and pose it from a frame on."""
    skeleton, zero = bvh.skeleton, bvh.skeleton.zero_positions
    up = _nearest_axis(zero[match.joints["head"]] - zero[match.joints["pelvis"]])
    left = _nearest_axis(zero[match.joints["left_hip"]] - zero[match.joints["right_hip"]])
    turn = np.stack([left, up, np.cross(left, up)]) if abs(up @ left) < 0.5 else np.eye(3)
    quarter = from_matrix(turn)
    turned = angle(quarter) > 1e-6
    note = f"zero pose has {_axis_name(up)} up and {_axis_name(left)} left: turned to y up, facing z" if turned else ""
    rotations, positions = _pose_rig(bvh, match, start)
    if turned:
        rotations = multiply(multiply(quarter, rotations), inverse(quarter))
        positions, zero = rotate(quarter, positions), rotate(quarter, zero)
    ends = {joint: rotate(quarter, end) for joint, end in skeleton.ends.items()}
    return Rig(skeleton, match, zero, ends, rotations, positions, note)


def _pose_rig(bvh: Bvh, match: JointMatch, start: int) -> tuple[Quaternion, Vector]:
    """Returns global rotations and positions. Bones below the pelvis keep their length, whatever their channels say."""
    rotations = bvh.rotations[start:].copy()
    positions = np.empty((*rotations.shape[:2], 3))
    for joint, parent in enumerate(bvh.skeleton.parents):
        moving = joint in match.carriers and joint in bvh.positions
        place = bvh.positions[joint][start:] if moving else bvh.skeleton.offsets[joint]
        if parent < 0:
            positions[:, joint] = place
        else:
            rotations[:, joint] = multiply(rotations[:, parent], rotations[:, joint])
            positions[:, joint] = positions[:, parent] + rotate(rotations[:, parent], place)
    return rotations, positions


def _nearest_axis(direction: Vector) -> Vector:
    axis = np.zeros(3)
    best = np.argmax(np.abs(direction))
    axis[best] = np.sign(direction[best])
    return axis


def _axis_name(axis: Vector) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("-" if axis[best] < 0 else "") + "xyz"[best]
