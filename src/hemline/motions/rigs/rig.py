"""A foreign rig, stood upright and posed."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hemline.motions.bvh import Bvh, Skeleton
from hemline.motions.quaternions import Quaternion, Vector, angle, from_matrix, inverse, multiply, rotate

from .names import Found


@dataclass(frozen=True, eq=False)
class Rig:
    """A rig with y up whose zero pose faces +z, in the file's unit.

    Attributes:
        skeleton: Its hierarchy, as in the file.
        found: Which joint is which.
        zero: Joint positions in the zero pose.
        ends: Offset of the End Site of leaf joints in the zero pose.
        rotations: Global rotation of each joint in each frame; identity is the zero pose.
        positions: Joint positions in each frame.
        note: What was turned, or nothing.
    """

    skeleton: Skeleton
    found: Found
    zero: Float[np.ndarray, "joints 3"]
    ends: dict[int, np.ndarray]
    rotations: Float[np.ndarray, "frames joints 4"]
    positions: Float[np.ndarray, "frames joints 3"]
    note: str

    def bone(self, joint: str, child: str) -> Vector:
        """From one of our joints to another in the zero pose."""
        return self.zero[self.found.joints[child]] - self.zero[self.found.joints[joint]]

    def tip(self, joint: int) -> Vector | None:
        """From a joint to its middle finger, else its index finger, first child but the thumb, or End Site."""
        names = {child: self.skeleton.names[child].lower() for child in self._children(joint)}
        fingers = [child for child in names if "thumb" not in names[child]]
        if not fingers:
            return self.ends.get(joint)
        best = next(child for finger in ("mid", "index", "") for child in fingers if finger in names[child])
        return self.zero[best] - self.zero[joint]

    def _children(self, joint: int) -> list[int]:
        return [child for child, parent in enumerate(self.skeleton.parents) if parent == joint]

    def seen(self, joint: str, points: Float[np.ndarray, "frames 3"]) -> Vector:
        """Mean direction from one of our joints to moving points, in the joint's own frame."""
        index = self.found.joints[joint]
        away = rotate(inverse(self.rotations[:, index]), points - self.positions[:, index])
        return (away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), 1e-12)).mean(axis=0)

    def zero_tip(self, joint: int) -> Vector:
        """Where the tip of a joint is in the zero pose; the joint itself where it has none."""
        tip = self.tip(joint)
        return self.zero[joint] + (np.zeros(3) if tip is None else tip)

    def placed_tip(self, joint: int) -> Float[np.ndarray, "frames 3"]:
        """Where that is in each frame."""
        return self.positions[:, joint] + rotate(self.rotations[:, joint], self.zero_tip(joint) - self.zero[joint])


def stood_upright(bvh: Bvh, found: Found, start: int) -> Rig:
    """Turn a rig by quarter turns so that its zero pose has y up and its left along +x, and pose it from a frame on."""
    skeleton, zero = bvh.skeleton, bvh.skeleton.zero_positions
    up = _nearest_axis(zero[found.joints["head"]] - zero[found.joints["pelvis"]])
    left = _nearest_axis(zero[found.joints["left_hip"]] - zero[found.joints["right_hip"]])
    turn = np.stack([left, up, np.cross(left, up)]) if abs(up @ left) < 0.5 else np.eye(3)
    quarter = from_matrix(turn)
    turned = angle(quarter) > 1e-6
    note = f"zero pose has {_axis_name(up)} up and {_axis_name(left)} left: turned to y up, facing z" if turned else ""
    rotations, positions = _posed(bvh, found, start)
    if turned:
        rotations = multiply(multiply(quarter, rotations), inverse(quarter))
        positions, zero = rotate(quarter, positions), rotate(quarter, zero)
    ends = {joint: rotate(quarter, end) for joint, end in skeleton.ends.items()}
    return Rig(skeleton, found, zero, ends, rotations, positions, note)


def _posed(bvh: Bvh, found: Found, start: int) -> tuple[Quaternion, Vector]:
    """Global rotations and positions; beyond the pelvis bones keep their length, whatever their channels say."""
    rotations = bvh.rotations[start:].copy()
    positions = np.empty((*rotations.shape[:2], 3))
    for joint, parent in enumerate(bvh.skeleton.parents):
        moving = joint in found.carriers and joint in bvh.positions
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
