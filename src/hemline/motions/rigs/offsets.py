"""Constant rotations O that turn the bones of our T-pose onto those of a rig's zero pose."""

import numpy as np

from hemline.motions.quaternions import Quaternion, Vector, between, from_axis_angle, inverse, multiply, rotate

from .rig import Rig
from .t_pose import t_pose_turns

IDENTITY = np.array([1.0, 0, 0, 0])
_DOWN, _BACK, _FORWARD = np.array([0.0, -1, 0]), np.array([0.0, 0, -1]), np.array([0.0, 0, 1])
_THUMB_AT_REST = np.array([0.0, -np.sin(np.pi / 3), np.cos(np.pi / 3)])
_STRAIGHT = 0.1
_STEEP_DEG = 60.0


def limb_offsets(rig: Rig) -> dict[str, Quaternion]:
    """Returns O of the joints of arms and legs; that of trunk, neck, head and collars is the identity.

    The direction of a bone does not determine its twist. In our T-pose elbows bend forward, knees backward, and the
    thumb points forward. The twist is chosen so that this agrees with the clip: seen from either bone of a bent limb,
    the far end of the other lies on the side to which the limb bends.
    """
    offsets: dict[str, Quaternion] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        out = np.array([sign, 0, 0])
        for chain, bone, bend in (
            (("hip", "knee", "ankle"), _DOWN, _BACK),
            (("shoulder", "elbow", "wrist"), out, _FORWARD),
        ):
            upper, lower, end = (f"{side}_{joint}" for joint in chain)
            places = {joint: rig.positions[:, rig.match.joints[joint]] for joint in (upper, end)}
            offsets[upper] = _align(bone, bend, rig.bone(upper, lower), rig.mean_direction(upper, places[end]))
            offsets[lower] = _align(bone, bend, rig.bone(lower, end), rig.mean_direction(lower, places[upper]))
        offsets[f"{side}_wrist"] = _hand_offset(rig, side, out, offsets[f"{side}_elbow"])
        offsets[f"{side}_ankle"] = offsets[f"{side}_foot"] = _foot_offset(rig, side)
    return offsets


def rest_offsets(rig: Rig) -> dict[str, Quaternion]:
    """Returns O of a rig whose zero pose is a rest pose, see `t_pose_turns`."""
    places = {name: rig.zero[joint] for name, joint in rig.match.joints.items()}
    return {joint: inverse(turn) for joint, turn in t_pose_turns(places).items()}


def _align(bone: Vector, side: Vector, rig_bone: Vector, rig_side: Vector) -> Quaternion:
    """Returns the rotation of `bone` onto `rig_bone` that brings `side` as near as possible to `rig_side`."""
    smallest = between(bone, rig_bone)
    along = rig_bone / np.linalg.norm(rig_bone)
    across = rig_side - (rig_side @ along) * along
    if np.linalg.norm(across) < _STRAIGHT:
        return smallest
    now = rotate(smallest, side)
    twist = np.arctan2(np.cross(now, across) @ along, now @ across)
    return multiply(from_axis_angle(twist * along), smallest)


def _hand_offset(rig: Rig, side: str, out: Vector, elbow_offset: Quaternion) -> Quaternion:
    """Returns O of the hand: palm down, thumb forward.

    The thumb of the zero pose lies in the plane of the palm. If it points along the fingers, that of the clip is used:
    a thumb at rest points about 60 degrees out of the palm (59 in the CMU recordings).
    """
    fingers = rig.tip(rig.match.joints[f"{side}_wrist"])
    if fingers is None or np.linalg.norm(fingers) == 0:
        return elbow_offset
    thumb = rig.match.thumbs.get(side)
    if thumb is None:
        return _align(out, _FORWARD, fingers, rotate(elbow_offset, _FORWARD))
    zero = rig.zero_tip(thumb) - rig.zero[rig.match.joints[f"{side}_wrist"]]
    if np.linalg.norm(np.cross(zero, fingers)) > _STRAIGHT * np.linalg.norm(zero) * np.linalg.norm(fingers):
        return _align(out, _FORWARD, fingers, zero / np.linalg.norm(zero))
    return _align(out, _THUMB_AT_REST, fingers, rig.mean_direction(f"{side}_wrist", rig.tip_path(thumb)))


def _foot_offset(rig: Rig, side: str) -> Quaternion:
    """Returns a quarter turn if the foot of the zero pose hangs down, the identity if it stands on the floor."""
    toes = rig.tip(rig.match.joints[f"{side}_ankle"])
    if toes is None or np.linalg.norm(toes) == 0:
        return IDENTITY
    steepness = np.degrees(np.arcsin(-toes[1] / np.linalg.norm(toes)))
    return from_axis_angle(np.array([np.pi / 2, 0, 0])) if steepness > _STEEP_DEG else IDENTITY
