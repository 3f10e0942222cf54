"""Finds how the axes of arms, legs, hands and feet of a rig stand to ours."""

import numpy as np

from hemline.arrays import Float
from hemline.motions.quaternions import Quaternion, Vector, between, from_axis_angle, inverse, multiply, rotate

from .quarters import FORWARD, IDENTITY, LEFT, OUT, UP, apart_deg, mean_rotation, nearest_quarter, turn_axes
from .rig import Rig
from .t_pose import t_pose_turns
from .trunk_axes import TrunkAxes

_DOWN, _BACK = -UP, -FORWARD
_THUMB_AT_REST = np.array([0.0, -np.sin(np.pi / 3), np.cos(np.pi / 3)])
_STRAIGHT = 0.1
_NEAR_DEG = 40.0
"""What the zero pose shows is taken where it is nearer than this to what the clip shows."""
_TWIST_DEG = 45.0
_FLAT_DEG, _STEEPEST_DEG = -15.0, 60.0
"""Slopes of a foot that stands on the floor [deg]."""
_USUAL_SLOPE_DEG = 28.0
"""Slope from ankle to ball of a foot on the floor [deg]."""
_SLOPE_OFF_DEG = 25.0
_SURE_DEG = 12.0
"""The slope of the feet on the floor is known if it differs by less than this, between feet and frames."""
_ON_FLOOR = 0.1
"""Fraction of the frames in which a foot is lowest."""
_EVEN = 0.06
"""The lowest feet are on a floor if their heights differ by less than this, as a fraction of the leg."""


def limb_axes(rig: Rig, trunk: TrunkAxes, up: Vector) -> dict[int, Quaternion]:
    """Returns the rotations O of the joints of arms and legs, by their index.

    The direction of a bone does not determine its twist. In our T-pose elbows bend forward, knees backward, and the
    thumb points forward. The twist is chosen so that this agrees with the clip: seen from either bone of a bent limb,
    the far end of the other lies on the side to which the limb bends. A limb that stays straight takes the twist of the
    bone that carries it.

    Args:
        rig: The rig, in some frames.
        trunk: Its trunk.
        up: The direction that is up in the world of the clip.
    """
    turns: dict[int, Quaternion] = {}
    slope = _floor_slope(rig, up)
    for side, out in OUT.items():
        for chain, bone, bend, carrier in (
            (("hip", "knee", "ankle"), _DOWN, _BACK, rig.index("pelvis")),
            (("shoulder", "elbow", "wrist"), out, FORWARD, rig.match.spine[-1]),
        ):
            upper, lower, end = (rig.index(f"{side}_{joint}") for joint in chain)
            carried = _side_of(rig, carrier, trunk.turns[carrier], bend)
            first, second = rig.zero[lower] - rig.zero[upper], rig.zero[end] - rig.zero[lower]
            bent = rig.mean_direction(upper, rig.positions[:, end])
            turns[upper] = _align(rig, upper, bone, bend, first, bent, carried, trunk.standing)
            carried = _side_of(rig, upper, turns[upper], bend)
            bent = rig.mean_direction(lower, rig.positions[:, upper])
            turns[lower] = _align(rig, lower, bone, bend, second, bent, carried, trunk.standing)
        if f"{side}_collar" in rig.match.joints:
            turns[rig.index(f"{side}_collar")] = _collar(rig, side, trunk)
        turns[rig.index(f"{side}_wrist")] = _hand(rig, side, turns[rig.index(f"{side}_elbow")], trunk.quarters)
        turns |= _foot(rig, side, turns[rig.index(f"{side}_knee")], trunk.standing, slope)
    return turns


def rest_axes(rig: Rig, standing: Quaternion) -> dict[int, Quaternion]:
    """Returns O of a rig whose zero pose is the rest pose of a character, see `t_pose_turns`.

    Args:
        rig: The rig.
        standing: The rotation of our axes to those of its zero pose.
    """
    places = {name: rotate(inverse(standing), rig.zero[joint]) for name, joint in rig.match.joints.items()}
    turns = t_pose_turns(places)
    return {joint: multiply(standing, inverse(turns.get(name, IDENTITY))) for name, joint in rig.match.joints.items()}


def _side_of(rig: Rig, joint: int, turn: Quaternion, side: Vector) -> Float[np.ndarray, "frames 3"]:
    """Returns a direction of our T-pose as a joint turns it, in each frame."""
    return rotate(rig.rotations[:, joint], rotate(turn, side))


def _align(
    rig: Rig,
    joint: int,
    bone: Vector,
    side: Vector,
    rig_bone: Vector,
    bent: Vector,
    carried: Float[np.ndarray, "frames 3"],
    standing: Quaternion | None,
) -> Quaternion:
    """Returns the rotation of `bone` onto `rig_bone` that brings `side` as near as possible to where the limb bends."""
    along = rig_bone / max(np.linalg.norm(rig_bone), 1e-12)
    if np.linalg.norm(bent - (bent @ along) * along) >= _STRAIGHT:
        turned = turn_axes(bone, rig_bone, side, bent)
        return IDENTITY if turned is None else turned
    if not np.linalg.norm(rig_bone) > 0:
        return IDENTITY if standing is None else standing
    seen = turn_axes(bone, rig_bone, side, rig.mean_in(joint, carried))
    natural = None
    if standing is not None:
        natural = multiply(between(rotate(standing, bone), rig_bone), standing)
    if seen is None:
        return between(bone, rig_bone) if natural is None else natural
    return natural if natural is not None and apart_deg(natural, seen) < _TWIST_DEG else seen


def _collar(rig: Rig, side: str, trunk: TrunkAxes) -> Quaternion:
    """Returns O of a collar, from which the arm goes out."""
    joint, out = rig.index(f"{side}_collar"), OUT[side]
    chest = rig.match.spine[-1]
    seen = turn_axes(
        out,
        rig.bone(f"{side}_collar", f"{side}_shoulder"),
        UP,
        rig.mean_in(joint, _side_of(rig, chest, trunk.turns[chest], UP)),
    )
    natural = trunk.standing
    if seen is None:
        return trunk.turns[chest] if natural is None else natural
    if natural is not None and apart_deg(natural, seen) < _NEAR_DEG:
        return natural
    quarter = nearest_quarter(seen)
    return quarter if trunk.quarters and apart_deg(quarter, seen) < _NEAR_DEG else seen


def _hand(rig: Rig, side: str, elbow: Quaternion, quarters: bool) -> Quaternion:
    """Returns O of the hand: palm down, thumb forward.

    The thumb of the zero pose lies in the plane of the palm. If it points along the fingers, that of the clip is used:
    a thumb at rest points about 60 degrees out of the palm (59 in the CMU recordings). A hand without a thumb is turned
    as the forearm in the zero pose, or in the mean over the clip if that is far from it.
    """
    joint, forearm, out = rig.index(f"{side}_wrist"), rig.index(f"{side}_elbow"), OUT[side]
    fingers = rig.tip(joint)
    if fingers is None or np.linalg.norm(fingers) == 0:
        arm = multiply(rig.rotations[:, forearm], elbow)
        seen = mean_rotation(multiply(inverse(rig.rotations[:, joint]), arm))
        return elbow if apart_deg(elbow, seen) < _TWIST_DEG else nearest_quarter(seen) if quarters else seen
    thumb = rig.match.thumbs.get(side)
    if thumb is not None:
        zero = rig.zero_tip(thumb) - rig.zero[joint]
        if np.linalg.norm(np.cross(zero, fingers)) > _STRAIGHT * np.linalg.norm(zero) * np.linalg.norm(fingers):
            return _or_between(turn_axes(out, fingers, FORWARD, zero), out, fingers)
        aside = rig.mean_direction(joint, rig.tip_path(thumb))
        along = fingers / np.linalg.norm(fingers)
        if np.linalg.norm(aside - (aside @ along) * along) >= _STRAIGHT:
            return _or_between(turn_axes(out, fingers, _THUMB_AT_REST, aside), out, fingers)
    natural = turn_axes(out, fingers, FORWARD, rotate(elbow, FORWARD))
    seen = turn_axes(out, fingers, FORWARD, rig.mean_in(joint, _side_of(rig, forearm, elbow, FORWARD)))
    if natural is None or seen is None:
        return _or_between(natural if seen is None else seen, out, fingers)
    if apart_deg(natural, seen) < _TWIST_DEG:
        return natural
    quarter_turns = [
        multiply(from_axis_angle(k * np.pi / 2 * fingers / np.linalg.norm(fingers)), natural) for k in (1, 2, 3)
    ]
    return min(quarter_turns, key=lambda turn: apart_deg(turn, seen)) if quarters else seen


def _or_between(turn: Quaternion | None, bone: Vector, rig_bone: Vector) -> Quaternion:
    return between(bone, rig_bone) if turn is None else turn


def _foot(
    rig: Rig, side: str, knee: Quaternion, standing: Quaternion | None, slope: float | None
) -> dict[int, Quaternion]:
    """Returns O of ankle and toes.

    The foot of the zero pose stands on the floor, or hangs by a quarter turn; if it does neither, or has another slope
    than the feet on the floor in the clip, that of the clip is taken, or the usual one.

    Args:
        rig: The rig.
        side: The side.
        knee: O of the knee, from which a foot takes its sides.
        standing: The axes of the trunk in the zero pose, if they are shared.
        slope: Slope of the feet on the floor in the clip, if it is known [deg].
    """
    ankle = rig.index(f"{side}_ankle")
    names = [rig.index(name) for name in (f"{side}_ankle", f"{side}_foot") if name in rig.match.joints]
    sole = rig.sole(side)
    shank = multiply(rig.rotations[:, rig.index(f"{side}_knee")], knee)
    if sole is None:
        seen = mean_rotation(multiply(inverse(rig.rotations[:, ankle]), shank))
        near = standing is not None and apart_deg(standing, seen) < _TWIST_DEG
        return dict.fromkeys(names, standing if near and standing is not None else seen)
    if standing is not None:
        steep = _slope_deg(rotate(inverse(standing), sole))
        if steep is not None and _stands(steep, slope):
            return dict.fromkeys(names, standing)
        hung = multiply(standing, from_axis_angle(np.array([np.pi / 2, 0, 0])))
        steep = _slope_deg(rotate(inverse(hung), sole))
        if steep is not None and _stands(steep, slope):
            return dict.fromkeys(names, hung)
    down = np.radians(_USUAL_SLOPE_DEG if slope is None else slope)
    flat = np.array([0.0, -np.sin(down), np.cos(down)])
    turn = turn_axes(flat, sole, LEFT, rig.mean_in(ankle, rotate(shank, LEFT)))
    turns = {ankle: between(flat, sole) if turn is None else turn}
    for toes in names[1:]:
        foot = multiply(rig.rotations[:, ankle], turns[ankle])
        seen = mean_rotation(multiply(inverse(rig.rotations[:, toes]), foot))
        turns[toes] = turns[ankle] if apart_deg(turns[ankle], seen) < _NEAR_DEG else seen
    return turns


def _slope_deg(sole: Vector) -> float | None:
    """Returns how far a foot that points forward slopes down; None if it points elsewhere."""
    if sole[2] <= 0.5 * np.linalg.norm(sole):
        return None
    return float(np.degrees(np.arctan2(-sole[1], np.hypot(sole[0], sole[2]))))


def _stands(slope: float, measured: float | None) -> bool:
    if not _FLAT_DEG <= slope <= _STEEPEST_DEG:
        return False
    return measured is None or abs(slope - measured) < _SLOPE_OFF_DEG


def _floor_slope(rig: Rig, up: Vector) -> float | None:
    """Returns the slope of the feet in the frames in which they are lowest; None if they do not show one [deg]."""
    slopes, levels = [], []
    for side in OUT:
        ankle = rig.index(f"{side}_ankle")
        sole = rig.sole(side)
        if sole is None:
            return None
        vectors = rotate(rig.rotations[:, ankle], sole)
        heights = (rig.positions[:, ankle] + 0.5 * vectors) @ up
        lowest = np.argsort(heights)[: max(int(_ON_FLOOR * len(heights)), 1)]
        slopes.append(np.degrees(np.arcsin(np.clip(-(vectors[lowest] @ up) / np.linalg.norm(sole), -1, 1))))
        levels.extend(heights[lowest])
    middles = [float(np.median(each)) for each in slopes]
    spread = max(float(np.ptp(np.percentile(each, [25, 75]))) for each in slopes)
    even = np.ptp(levels) < _EVEN * rig.leg_length()
    known = even and abs(middles[0] - middles[1]) < _SURE_DEG and spread < _SURE_DEG
    slope = float(np.mean(middles))
    return slope if known and 0 <= slope <= _STEEPEST_DEG else None
