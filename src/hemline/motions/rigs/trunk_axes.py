"""Finds how the axes of pelvis, spine, neck and head of a rig stand to ours."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float
from hemline.motions.quaternions import Quaternion, inverse, multiply, rotate

from .quarters import LEFT, UP, apart_deg, mean_rotation, nearest_quarter, turn_axes
from .rig import Rig

_PELVIS_DEG, _TRUNK_DEG, _HEAD_DEG = 40.0, 30.0, 40.0
"""Largest angles between what bones show and the axes of a joint, which stand askew to its bones in most rigs: the
spine of LAFAN1 leaves its pelvis at 33 degrees, that of CMU at 25."""
_ALIKE_DEG = 25.0
_QUARTER_DEG = 12.0
"""A rig has axes by quarter turns if half of its joints are nearer to them than this."""
_SHORT = 0.03
"""A bone shorter than this tells no direction, as a fraction of the leg."""


@dataclass(frozen=True, eq=False)
class TrunkAxes:
    """The rotations O of the trunk, which take our T-pose's axes to those of a joint, and what they show.

    Attributes:
        turns: O by the index of the joint: pelvis, spine, neck and head.
        standing: O of a rig whose trunk is straight in the zero pose, the same for all joints; None: it is not.
        quarters: Whether the joints have axes by quarter turns.
    """

    turns: Mapping[int, Quaternion]
    standing: Quaternion | None
    quarters: bool


def trunk_axes(rig: Rig, *, trust_zero: bool = True) -> TrunkAxes:
    r"""Returns the rotations O of pelvis, spine, neck and head.

    In a frame with global rotation $G$ the joint of our body is turned by $G O$. What bones show comes first: the hips
    lie to the sides of the pelvis, the arms to those of the chest, and each joint has the next one above it; a joint of
    which bones show no side has that of pelvis and chest in the mean over the clip, and the head looks ahead in the
    mean. Bones do not stand plumb in a T-pose, though. So where the axes of the zero pose, or quarter turns of them,
    are near to what bones show, they are taken.

    Args:
        rig: The rig, in some frames.
        trust_zero: Whether the zero pose may be a T-pose; False for rigs whose zero pose is some frame of a clip.
    """
    seen = _bone_axes(rig)
    body = [seen[joint] for joint in _chain(rig)]
    standing = _standing(rig, seen) if trust_zero else None
    off = [apart_deg(turn, nearest_quarter(turn)) for turn in body]
    quarters = trust_zero and float(np.median(off)) < _QUARTER_DEG
    head = rig.index("head")
    turns = {}
    for joint, turn in seen.items():
        limit = _PELVIS_DEG if joint == rig.index("pelvis") else _HEAD_DEG if joint == head else _TRUNK_DEG
        limit = _HEAD_DEG if joint == rig.match.joints.get("neck") else limit
        turns[joint] = turn
        for natural in (standing, nearest_quarter(turn) if quarters else None):
            if natural is not None and apart_deg(natural, turn) < limit:
                turns[joint] = natural
                break
    return TrunkAxes(turns, standing, quarters)


def _chain(rig: Rig) -> tuple[int, ...]:
    return rig.index("pelvis"), *rig.match.spine


def _standing(rig: Rig, seen: Mapping[int, Quaternion]) -> Quaternion | None:
    """Returns the axes that all joints of the trunk share in the zero pose, if they do."""
    chain = _chain(rig)
    body = np.array([seen[joint] for joint in chain])
    limits = [_PELVIS_DEG, *[_TRUNK_DEG] * (len(chain) - 1)]
    middle = mean_rotation(body[[0, -1]])
    for shared, scale in ((nearest_quarter(middle), 1.0), (middle, _ALIKE_DEG / _PELVIS_DEG)):
        if all(apart_deg(turn, shared) < scale * limit for turn, limit in zip(body, limits, strict=True)):
            return shared
    return None


def _bone_axes(rig: Rig) -> dict[int, Quaternion]:
    """Returns what bones show of each joint of the trunk."""
    chain, head = _chain(rig), rig.index("head")
    short = _SHORT * rig.leg_length()
    middle = 0.5 * (rig.path("left_hip") + rig.path("right_hip"))
    above = [rig.positions[:, joint] for joint in (*chain[1:], rig.match.joints.get("neck", head), head)]
    seen = {
        chain[0]: _by_sides(rig, chain[0], rig.path("left_hip") - rig.path("right_hip"), middle, above[:-1], short),
        chain[-1]: _by_sides(
            rig, chain[-1], _shoulder_line(rig, short), rig.positions[:, chain[-1]], above[len(chain) - 1 :], short
        ),
    }
    left = _side_axis(rig, seen, chain[0]) + _side_axis(rig, seen, chain[-1])
    for place, joint in enumerate(chain[1:-1], 1):
        seen[joint] = _by_up(rig, joint, above[place:], left, short)
    if "neck" in rig.match.joints:
        neck = rig.index("neck")
        seen[neck] = _by_up(rig, neck, [rig.path("head")], _side_axis(rig, seen, chain[-1]), short)
    chest = multiply(rig.rotations[:, chain[-1]], seen[chain[-1]])
    seen[head] = mean_rotation(multiply(inverse(rig.rotations[:, head]), chest))
    return seen


def _shoulder_line(rig: Rig, short: float) -> Float[np.ndarray, "frames 3"]:
    """Returns the vectors from right to left across the chest: between collars, or between arms."""
    for joint in ("collar", "shoulder"):
        if f"left_{joint}" in rig.match.joints and f"right_{joint}" in rig.match.joints:
            line = rig.path(f"left_{joint}") - rig.path(f"right_{joint}")
            if np.linalg.norm(line, axis=1).mean() > short:
                return line
    return rig.path("left_elbow") - rig.path("right_elbow")


def _side_axis(rig: Rig, seen: Mapping[int, Quaternion], joint: int) -> Float[np.ndarray, "frames 3"]:
    return rotate(rig.rotations[:, joint], rotate(seen[joint], LEFT))


def _by_sides(
    rig: Rig, joint: int, line: np.ndarray, start: np.ndarray, above: list[np.ndarray], short: float
) -> Quaternion:
    """Returns O of a joint by the line across it, and by the first point above that is not in it."""
    left = rig.mean_in(joint, line)
    for points in above:
        up = rig.mean_in(joint, points - start)
        if np.linalg.norm(up - (up @ left) * left / max(left @ left, 1e-12)) > short:
            return _or_zero(turn_axes(LEFT, left, UP, up))
    return _or_zero(None)


def _by_up(rig: Rig, joint: int, above: list[np.ndarray], left: np.ndarray, short: float) -> Quaternion:
    """Returns O of a joint by the first point above that is not in it, and by the mean of lines across the trunk."""
    across = rig.mean_in(joint, left)
    for points in above:
        up = rig.mean_in(joint, points - rig.positions[:, joint])
        if np.linalg.norm(up) > short:
            return _or_zero(turn_axes(UP, up, LEFT, across))
    return _or_zero(None)


def _or_zero(turn: Quaternion | None) -> Quaternion:
    """Returns a rotation, or that of a joint whose bones show nothing, which is taken as it is."""
    return np.array([1.0, 0, 0, 0]) if turn is None else turn
