"""Retargets a clip of any humanoid rig onto the 24 joints."""

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion
from hemline.motions.bvh import Bvh
from hemline.motions.motion import JOINT_NAMES, PARENTS, Motion
from hemline.motions.quaternions import Quaternion, angle, continuous, inverse, multiply, slerp

from .collars import collar_from_arm, is_still
from .names import JointMatch, find_joints
from .offsets import IDENTITY, limb_offsets, rest_offsets
from .rig import Rig, turn_upright
from .units import METRIC, UNITS, USUAL_LEG, unit_of

_TPOSE_DEG = 3.0
_RUN_IN_DEG_S = 400.0


def retarget(
    bvh: Bvh,
    *,
    unit: str | None = None,
    name: str = "",
    source: str = "",
    licence: str = "",
    match: JointMatch | None = None,
    resting: bool = False,
) -> Motion:
    r"""Retargets a clip onto the 24 joints: T-pose convention, metres, y up.

    $$G'_j = G_j O_j, \qquad R'_j = {G'_p}^{-1} G'_j$$

    Here $G_j$ is the global rotation of the source's joint and $O_j$ the constant rotation of the bone of our T-pose
    onto that of the source's zero pose (`limb_offsets`). The pelvis is placed midway between the source's hip joints,
    since these carry the legs, by whose length the translation is scaled later. Collars that stand still throughout, as
    in the CMU recordings, move with the arms (`collar_from_arm`).

    Args:
        bvh: The clip as read.
        unit: `m`, `cm`, `mm`, `inch` or `cmu`; None: guessed from the size.
        name: Name of the motion.
        source: Where the motion comes from.
        licence: Terms, in short.
        match: Joints of the rig by role; None: by names, or by their places in the tree.
        resting: Whether the zero pose is the rest pose of a character, a T-pose or an A-pose. Then O is that of
            `t_pose_turns`, as on the body that is made of the character, and collars move as in the clip.

    Raises:
        BadMotion: A joint that is needed is missing, or the unit contradicts the size.
    """
    match = match or find_joints(bvh.skeleton, name)
    start = _tpose_frames(bvh, match)
    rig = turn_upright(bvh, match, start)
    leg = float(np.mean([_leg(rig, "left"), _leg(rig, "right")]))
    scale, unit_note = _scale(leg, unit, name, resting)
    offsets = rest_offsets(rig) if resting else limb_offsets(rig)
    rotations = _global_rotations(rig, offsets)
    collar_note = "" if resting else _move_collars_with_arms(rotations)
    for joint in reversed(range(1, len(PARENTS))):
        rotations[:, joint] = multiply(inverse(rotations[:, PARENTS[joint]]), rotations[:, joint])
    hips = [rig.positions[:, match.joints[hip]] for hip in ("left_hip", "right_hip")]
    tpose_note = f"frames 0 to {start - 1} lead out of a T-pose and were dropped" if start else ""
    return Motion(
        rotations=continuous(rotations),
        translations=np.mean(hips, axis=0) * scale,
        fps=bvh.fps,
        leg_length=leg * scale,
        name=name,
        source=source,
        licence=licence,
        notes=tuple(
            note
            for note in (
                *_match_note(match),
                unit_note,
                rig.note,
                tpose_note,
                collar_note,
                _note_ignored(rig),
            )
            if note
        ),
    )


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


def _leg(rig: Rig, side: str) -> float:
    thigh, shank = rig.bone(f"{side}_hip", f"{side}_knee"), rig.bone(f"{side}_knee", f"{side}_ankle")
    return float(np.linalg.norm(thigh) + np.linalg.norm(shank))


def _match_note(match: JointMatch) -> tuple[str, ...]:
    return (f"joints found by {match.how}",) if match.how else ()


def _global_rotations(rig: Rig, offsets: dict[str, Quaternion]) -> Float[np.ndarray, "frames 24 4"]:
    joints = rig.match.joints
    rotations = np.empty((len(rig.rotations), len(JOINT_NAMES), 4))
    for joint, name in enumerate(JOINT_NAMES):
        if name.startswith("spine"):
            rotations[:, joint] = _spine(rig, int(name[-1]))
        elif name in joints:
            rotations[:, joint] = multiply(rig.rotations[:, joints[name]], offsets.get(name, IDENTITY))
        elif name == "neck":
            rotations[:, joint] = slerp(rotations[:, PARENTS[joint]], rig.rotations[:, joints["head"]], 0.5)
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


def _spine(rig: Rig, level: int) -> Quaternion:
    """Returns the global rotation of spine joint 1, 2 or 3, spread evenly over the joints that the rig has."""
    chain = (rig.match.joints["pelvis"], *rig.match.spine)
    place = level * len(rig.match.spine) / 3
    below = min(int(place + 1e-9), len(chain) - 2)
    return slerp(rig.rotations[:, chain[below]], rig.rotations[:, chain[below + 1]], place - below)


def _note_ignored(rig: Rig) -> str:
    used = {*rig.match.joints.values(), *rig.match.spine}
    names = [name for joint, name in enumerate(rig.skeleton.names) if joint not in used]
    return f"joints that only carry others, or are ignored: {', '.join(names)}" if names else ""


def _tpose_frames(bvh: Bvh, match: JointMatch) -> int:
    """Returns the number of frames at the start that are a T-pose and the transition from it into the motion."""
    used = sorted({*match.joints.values(), *match.spine})
    rotations = bvh.rotations[:, used]
    if len(rotations) < 2:
        return 0
    first, second = np.degrees(angle(rotations[:2])).mean(axis=1)
    if first > _TPOSE_DEG or second < first + _TPOSE_DEG:
        return 0
    speeds = np.degrees(angle(multiply(inverse(rotations[:-1]), rotations[1:]))).mean(axis=1) * bvh.fps
    calm = speeds[1:] < _RUN_IN_DEG_S
    return 1 + int(np.argmax(calm)) if calm.any() else 1
