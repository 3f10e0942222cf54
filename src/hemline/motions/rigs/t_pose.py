"""Turns the rest pose of a rig into the T-pose."""

from collections.abc import Mapping

import numpy as np

from hemline.motions.quaternions import Quaternion, Vector, between, from_axis_angle, multiply, rotate

LOWERED_DEG = 12.0
"""Angle by which the collar of a hanging arm is lowered from the T-pose [deg]."""

_BENT_DEG = 15.0
"""A leg is not straight if its bones lean forward or back by more than this at rest [deg]."""
_OUT, _DOWN = np.array([1.0, 0, 0]), np.array([0.0, -1, 0])
_IDENTITY = np.array([1.0, 0, 0, 0])


def t_pose_turns(places: Mapping[str, Vector]) -> dict[str, Quaternion]:
    """Returns global rotations that turn limbs at rest to the T-pose: arms along x, legs vertical from the front.

    Each limb bone takes its parent's rotation, then the smallest one that aligns it; trunk, head and feet do not turn.
    A collar is assumed to be lowered at rest by 12 degrees times the cosine between the arm and straight down.

    Args:
        places: Positions of the rig's joints at rest by name, y up, facing +z; collars, feet and hands are optional
            [m].

    Returns:
        A rotation for each joint of arms and legs that the rig has.
    """
    turns: dict[str, Quaternion] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm = [np.asarray(places[f"{side}_{name}"], np.float64) for name in ("shoulder", "elbow", "wrist")]
        turn = _IDENTITY
        if f"{side}_collar" in places:
            down = (arm[1] - arm[0]) @ _DOWN / np.linalg.norm(arm[1] - arm[0])
            turn = from_axis_angle(np.array([0, 0, sign * np.deg2rad(LOWERED_DEG) * max(down, 0.0)]))
            turns[f"{side}_collar"] = turn
        for name, start, end in (("shoulder", arm[0], arm[1]), ("elbow", arm[1], arm[2])):
            turn = turns[f"{side}_{name}"] = _align(turn, end - start, sign * _OUT)
        hand = places.get(f"{side}_hand")
        turns[f"{side}_wrist"] = turn if hand is None else _align(turn, hand - arm[2], sign * _OUT)
        turns[f"{side}_hand"] = turns[f"{side}_wrist"]
        leg = [np.asarray(places[f"{side}_{name}"], np.float64) for name in ("hip", "knee", "ankle")]
        thigh, shank = leg[1] - leg[0], leg[2] - leg[1]
        if max(_leaning_deg(thigh), _leaning_deg(shank)) > _BENT_DEG:
            turns[f"{side}_hip"] = _align(_IDENTITY, thigh, _DOWN)
            turns[f"{side}_knee"] = _align(turns[f"{side}_hip"], shank, _DOWN)
        else:
            turns[f"{side}_hip"] = turns[f"{side}_knee"] = between(thigh * [1, 1, 0], _DOWN)
    return turns


def _align(turn: Quaternion, bone: Vector, direction: Vector) -> Quaternion:
    """Returns a rotation followed by the smallest one that aligns the turned bone with a direction."""
    turned = rotate(turn, bone)
    return multiply(between(turned, direction), turn) if np.linalg.norm(bone) > 0 else turn


def _leaning_deg(bone: Vector) -> float:
    return float(np.degrees(np.arctan2(abs(bone[2]), abs(bone[1]) + 1e-12)))
