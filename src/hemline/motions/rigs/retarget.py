"""Retargets a clip of any humanoid rig onto the 24 joints."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion, HemlineWarning
from hemline.motions.bvh import Bvh
from hemline.motions.motion import JOINT_NAMES, PARENTS, Motion
from hemline.motions.quaternions import Quaternion, Vector, angle, continuous, inverse, multiply, rotate, slerp

from .agreement import BONE_DEG, MEAN_DEG, bone_errors, worst_bones
from .collars import collar_from_arm, is_still
from .limb_axes import limb_axes, rest_axes
from .names import JointMatch, find_joints
from .quarters import UP, apart_deg, nearest_quarter
from .rest_pose import is_rest_pose
from .rig import Rig, pose_rig
from .trunk_axes import TrunkAxes, trunk_axes
from .units import METRIC, UNITS, USUAL_LEG, unit_of
from .upright import AXES, BodyPlaces, Upright, find_up, turn_to_y

_TPOSE_DEG = 3.0
_RUN_IN_DEG_S = 400.0
_LOOKED_AT = 400
"""Number of frames from which axes are found."""


@dataclass(frozen=True, eq=False)
class Retargeted:
    """A clip on the 24 joints, beside the rig that it comes from.

    Attributes:
        motion: The clip.
        rig: The rig in the same frames.
        turn: The rotation of its world to y up.
        scale: Size of its unit [m].
        up: The axis that is up in it.
        rest: A sentence about its zero pose; empty: a T-pose, or one that does not matter.
        bone_errors: Mean angle between main bones of the result and of the source, by name [deg].
    """

    motion: Motion
    rig: Rig
    turn: Quaternion
    scale: float
    up: str
    rest: str
    bone_errors: Mapping[str, float]

    def places(self, frame: int) -> Float[np.ndarray, "source_joints 3"]:
        """Returns the joints of the source in a frame, turned and scaled as the clip is [m]."""
        return rotate(self.turn, self.rig.positions[frame]) * self.scale


def retarget(bvh: Bvh, **options: Any) -> Motion:
    """Retargets a clip of any humanoid rig onto the 24 joints, see `retarget_beside`."""
    return retarget_beside(bvh, **options).motion


def retarget_beside(
    bvh: Bvh,
    *,
    unit: str | None = None,
    up: str | None = None,
    name: str = "",
    source: str = "",
    licence: str = "",
    match: JointMatch | None = None,
    resting: bool = False,
    file: str = "",
) -> Retargeted:
    r"""Retargets a clip onto the 24 joints, and keeps its rig: T-pose convention, metres, y up.

    $$G'_j = W G_j O_j, \qquad R'_j = {G'_p}^{-1} G'_j$$

    Here $G_j$ is the global rotation of the source's joint, $O_j$ the constant rotation of the axes of our T-pose to
    those of the joint (`trunk_axes`, `limb_axes`), and $W$ turns the world of the clip to y up (`find_up`). Both come
    from the posed frames: the zero pose of many rigs is no T-pose. The pelvis is placed midway between the source's hip
    joints, since these carry the legs, by whose length the translation is scaled later. Collars that stand still
    throughout, as in the CMU recordings, move with the arms (`collar_from_arm`).

    Args:
        bvh: The clip as read.
        unit: `m`, `cm`, `mm`, `inch` or `cmu`; None: guessed from the size.
        up: The axis that is up, `x`, `y`, `z`, `-x`, `-y` or `-z`; None: found.
        name: Name of the motion.
        source: Where the motion comes from.
        licence: Terms, in short.
        match: Joints of the rig by role; None: by names, or by their places in the tree.
        resting: Whether the zero pose is the rest pose of a character. If it is a T-pose or an A-pose, O is that of
            `t_pose_turns`, as on the body that is made of the character, and collars move as in the clip.
        file: Name of the file in messages; empty: that of the motion.

    Raises:
        BadMotion: A joint that is needed is missing, the unit contradicts the size, or bones of the result do not point
            where those of the source point.

    Warns:
        HemlineWarning: A bone points elsewhere than in the source, or the body lies in nearly all frames.
    """
    file = file or name
    match = match or find_joints(bvh.skeleton, file, bvh=bvh)
    rig = pose_rig(bvh, match)
    scale, unit_note = _scale(rig.leg_length(), unit, file, resting)
    looked_at = rig.sample(_LOOKED_AT)
    trunk = trunk_axes(looked_at)
    rests = resting and trunk.standing is not None and is_rest_pose(rig, trunk.standing)
    if resting and not rests:
        trunk = trunk_axes(looked_at, trust_zero=False)
    start = 0 if trunk.standing is None else _tpose_frames(_body_rotations(bvh.rotations, match), bvh.fps)
    rig = rig.cut(slice(start, None))
    looked_at = rig.sample(_LOOKED_AT)
    upright = find_up(_body_points(looked_at), _zero_up(trunk), up, file, by_format=resting)
    turn = _world_turn(trunk, upright)
    if rests and trunk.standing is not None:
        axes = {**trunk.turns, **rest_axes(rig, trunk.standing)}
        axes |= dict.fromkeys(match.spine, trunk.standing)
    else:
        axes = {**trunk.turns, **limb_axes(rig, trunk, np.array(AXES[upright.axis]))}
    turned = _global_rotations(rig, turn, axes)
    if trunk.standing is None and (late := _tpose_frames(_local(turned), bvh.fps)):
        start, turned, rig = late, turned[late:], rig.cut(slice(late, None))
    errors, bones_note = _compare_bones(rig, turn, turned, file)
    rest = _axes_note(trunk, upright, rests)
    collar_note = "" if resting else _move_collars_with_arms(turned)
    hips = np.mean([rig.path(hip) for hip in ("left_hip", "right_hip")], axis=0)
    notes = (
        *bvh.notes,
        *_match_note(match),
        unit_note,
        rest,
        upright.note,
        _say_doubt(upright),
        bones_note,
        f"frames 0 to {start - 1} lead out of a T-pose and were dropped" if start else "",
        collar_note,
        _note_ignored(rig),
    )
    motion = Motion(
        rotations=continuous(_local(turned)),
        translations=rotate(turn, hips) * scale,
        fps=bvh.fps,
        leg_length=rig.leg_length() * scale,
        name=name,
        source=source,
        licence=licence,
        notes=tuple(note for note in notes if note),
    )
    return Retargeted(motion, rig, turn, scale, upright.axis, rest, errors)


def _scale(leg: float, unit: str | None, name: str, resting: bool) -> tuple[float, str]:
    """Returns the size of the clip's unit [m], and a note that says how it was found.

    Characters may have any size, since clips are scaled to the body's legs.
    """
    if not resting:
        unit, note = unit_of(leg, unit, name)
        return UNITS[unit], note
    try:
        unit, note = unit_of(leg, None, name, units=METRIC)
        return METRIC[unit], note
    except BadMotion:
        if not leg > 0:
            raise
        return USUAL_LEG / leg, f"legs of {leg:.4g} are those of no person: scaled to {USUAL_LEG} m"


def _match_note(match: JointMatch) -> tuple[str, ...]:
    return (f"joints found by {match.how}",) if match.how else ()


def _body_rotations(
    rotations: Float[np.ndarray, "frames joints 4"], match: JointMatch
) -> Float[np.ndarray, "frames used 4"]:
    return rotations[:, sorted({*match.joints.values(), *match.spine})]


def _body_points(rig: Rig) -> BodyPlaces:
    body = sorted({*rig.match.joints.values(), *rig.match.spine})
    return BodyPlaces(
        pelvis=0.5 * (rig.path("left_hip") + rig.path("right_hip")),
        head=rig.path("head"),
        ankles=0.5 * (rig.path("left_ankle") + rig.path("right_ankle")),
        joints=rig.positions[:, body],
        leg=rig.leg_length(),
    )


def _up_of(standing: Quaternion) -> Vector:
    return rotate(standing, UP)


def _axis_name(axis: Vector) -> str:
    best = int(np.argmax(np.abs(axis)))
    return ("-" if axis[best] < 0 else "") + "xyz"[best]


def _zero_up(trunk: TrunkAxes) -> str:
    """Returns the axis that is up in the zero pose, if a body stands in it; else y."""
    return "y" if trunk.standing is None else _axis_name(_up_of(trunk.standing))


def _world_turn(trunk: TrunkAxes, upright: Upright) -> Quaternion:
    """Returns the rotation of the clip's world to y up; if up is that of the zero pose, this one comes to face z."""
    if trunk.standing is not None and _zero_up(trunk) == upright.axis:
        quarter = nearest_quarter(trunk.standing)
        if _axis_name(_up_of(quarter)) == upright.axis:
            return inverse(quarter)
    return turn_to_y(np.array(AXES[upright.axis]))


def _axes_note(trunk: TrunkAxes, upright: Upright, rests: bool) -> str:
    if trunk.standing is None:
        how = "by quarter turns" if trunk.quarters else "in any way"
        return f"the zero pose is no T-pose: axes of the joints, turned {how}, were found from the bones in the frames"
    if apart_deg(trunk.standing, np.array([1.0, 0, 0, 0])) < 1e-4:
        return ""
    left = rotate(trunk.standing, np.array([1.0, 0, 0]))
    zero = f"zero pose has {_axis_name(_up_of(trunk.standing))} up and {_axis_name(left)} left"
    return f"{zero}: turned to y up, facing z" if _zero_up(trunk) == upright.axis else zero


def _say_doubt(upright: Upright) -> str:
    if not upright.doubt:
        return ""
    warnings.warn(HemlineWarning(*upright.doubt), stacklevel=2)
    return f"{upright.doubt[0]}, {upright.doubt[1]}"


def _compare_bones(
    rig: Rig, turn: Quaternion, rotations: Float[np.ndarray, "frames 24 4"], name: str
) -> tuple[dict[str, float], str]:
    """Returns the angles between the bones of the result and those of the source, and a note.

    Raises:
        BadMotion: They are far apart.

    Warns:
        HemlineWarning: Some of them are far apart.
    """
    every = slice(None, None, -(-len(rig) // _LOOKED_AT))
    errors = bone_errors(rig.cut(every), turn, rotations[every])
    mean = float(np.mean(list(errors.values())))
    cure = "export the clip with a T-pose at rest, or as GLB with its skin; 'hemline explain' draws what was understood"
    if mean > MEAN_DEG:
        got = worst_bones(errors, 0.0)
        raise BadMotion(f"the skeleton of {name} was not understood: bones would point elsewhere", got, cure)
    if off := worst_bones(errors, BONE_DEG):
        warnings.warn(HemlineWarning(f"bones of {name} point elsewhere than in the source", off, cure), stacklevel=3)
        return errors, f"bones that point elsewhere than in the source: {off}"
    return errors, ""


def _local(turned: Float[np.ndarray, "frames 24 4"]) -> Float[np.ndarray, "frames 24 4"]:
    local = turned.copy()
    local[:, 1:] = multiply(inverse(turned[:, PARENTS[1:]]), turned[:, 1:])
    return local


def _global_rotations(rig: Rig, turn: Quaternion, axes: Mapping[int, Quaternion]) -> Float[np.ndarray, "frames 24 4"]:
    joints = rig.match.joints

    def turn_joint(joint: int) -> Quaternion:
        return multiply(turn, multiply(rig.rotations[:, joint], axes[joint]))

    rotations = np.empty((len(rig.rotations), len(JOINT_NAMES), 4))
    chain = (joints["pelvis"], *rig.match.spine)
    for joint, name in enumerate(JOINT_NAMES):
        if name.startswith("spine"):
            place = int(name[-1]) * len(rig.match.spine) / 3  # spread evenly over the joints that the rig has
            below = min(int(place + 1e-9), len(chain) - 2)
            rotations[:, joint] = slerp(turn_joint(chain[below]), turn_joint(chain[below + 1]), place - below)
        elif name in joints:
            rotations[:, joint] = turn_joint(joints[name])
        elif name == "neck":
            rotations[:, joint] = slerp(rotations[:, PARENTS[joint]], turn_joint(joints["head"]), 0.5)
        else:
            rotations[:, joint] = rotations[:, PARENTS[joint]]
    return rotations


def _move_collars_with_arms(rotations: Float[np.ndarray, "frames 24 4"]) -> str:
    """Moves collars that stand still with the arms, in place; returns a note that says so."""
    note = ""
    for side, sign in (("left", 1.0), ("right", -1.0)):
        chest, collar, shoulder = (JOINT_NAMES.index(name) for name in ("spine3", f"{side}_collar", f"{side}_shoulder"))
        if is_still(multiply(inverse(rotations[:, chest]), rotations[:, collar])):
            rotations[:, collar] = collar_from_arm(rotations[:, chest], rotations[:, shoulder], sign)
            note = "the collars of the recording stand still: raised and lowered with the arms"
    return note


def _note_ignored(rig: Rig) -> str:
    used = {*rig.match.joints.values(), *rig.match.spine}
    names = [name for joint, name in enumerate(rig.skeleton.names) if joint not in used]
    return f"joints that only carry others, or are ignored: {', '.join(names)}" if names else ""


def _tpose_frames(rotations: Float[np.ndarray, "frames used 4"], fps: float) -> int:
    """Returns the number of frames at the start that are a T-pose and the transition from it into the motion."""
    if len(rotations) < 2:
        return 0
    first, second = np.degrees(angle(rotations[:2])).mean(axis=1)
    if first > _TPOSE_DEG or second < first + _TPOSE_DEG:
        return 0
    speeds = np.degrees(angle(multiply(inverse(rotations[:-1]), rotations[1:]))).mean(axis=1) * fps
    calm = speeds[1:] < _RUN_IN_DEG_S
    return 1 + int(np.argmax(calm)) if calm.any() else 1
