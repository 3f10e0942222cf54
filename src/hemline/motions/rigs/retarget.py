"""Bring a clip of any humanoid rig onto the 24 joints."""

import numpy as np
from jaxtyping import Float

from hemline.errors import BadMotion
from hemline.motions.bvh import Bvh
from hemline.motions.motion import JOINT_NAMES, PARENTS, Motion
from hemline.motions.quaternions import Quaternion, angle, continuous, inverse, multiply, slerp

from .collars import carried_by_arm, stand_still
from .names import Found, find_joints
from .offsets import IDENTITY, limb_offsets, rest_offsets
from .rig import Rig, stood_upright
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
    found: Found | None = None,
    resting: bool = False,
) -> Motion:
    r"""A motion on our joints: T-pose convention, metres, y up.

    $$G'_j = G_j O_j, \qquad R'_j = {G'_p}^{-1} G'_j$$

    with $G_j$ the global rotation of the source's joint and $O_j$ the constant that takes the bone of our T-pose onto
    the bone of the source's zero pose (`limb_offsets`). The pelvis is put midway between the source's hip joints, since
    these carry the legs, whose length the translation is later scaled by. Collars that stand still throughout, as in
    the CMU recordings, go with the arms (`carried_by_arm`).

    Args:
        bvh: The clip as read.
        unit: `m`, `cm`, `mm`, `inch` or `cmu`; None to guess it from the size.
        name: What to call it.
        source: Where it comes from.
        licence: Terms, in short.
        found: Which joint is which; None: by names, or by their places in the tree.
        resting: The zero pose is the rest pose of a character, who stands in a T-pose or an A-pose: O is that of
            `t_pose_turns`, as on the body that is made of the character; collars are as the clip has them.

    Raises:
        BadMotion: A joint that is needed is missing, or the unit contradicts the size.
    """
    found = found or find_joints(bvh.skeleton, name)
    start = _tpose_frames(bvh, found)
    rig = stood_upright(bvh, found, start)
    leg = float(np.mean([_leg(rig, "left"), _leg(rig, "right")]))
    scale, unit_note = _scale(leg, unit, name, resting)
    offsets = rest_offsets(rig) if resting else limb_offsets(rig)
    rotations = _global_rotations(rig, offsets)
    collar_note = "" if resting else _lively_collars(rotations)
    for joint in reversed(range(1, len(PARENTS))):
        rotations[:, joint] = multiply(inverse(rotations[:, PARENTS[joint]]), rotations[:, joint])
    hips = [rig.positions[:, found.joints[hip]] for hip in ("left_hip", "right_hip")]
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
            note for note in (*_how(found), unit_note, rig.note, tpose_note, collar_note, _ignored(rig)) if note
        ),
    )


def _scale(leg: float, unit: str | None, name: str, resting: bool) -> tuple[float, str]:
    """Metres in the clip's unit, and why; characters may have any size, since clips are scaled to the body's legs."""
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


def _how(found: Found) -> tuple[str, ...]:
    return (f"joints found by {found.how}",) if found.how else ()


def _global_rotations(rig: Rig, offsets: dict[str, Quaternion]) -> Float[np.ndarray, "frames 24 4"]:
    joints = rig.found.joints
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


def _lively_collars(rotations: Float[np.ndarray, "frames 24 4"]) -> str:
    """Turn collars that stand still with the arms, in place; the sentence that says so."""
    note = ""
    for side, sign in (("left", 1.0), ("right", -1.0)):
        chest, collar, shoulder = (JOINT_NAMES.index(name) for name in ("spine3", f"{side}_collar", f"{side}_shoulder"))
        if stand_still(multiply(inverse(rotations[:, chest]), rotations[:, collar])):
            rotations[:, collar] = carried_by_arm(rotations[:, chest], rotations[:, shoulder], sign)
            note = "the collars of the recording stand still: raised and lowered with the arms"
    return note


def _spine(rig: Rig, level: int) -> Quaternion:
    """Global rotation of spine joint 1, 2 or 3, spread evenly over the joints that the rig has."""
    chain = (rig.found.joints["pelvis"], *rig.found.spine)
    place = level * len(rig.found.spine) / 3
    below = min(int(place + 1e-9), len(chain) - 2)
    return slerp(rig.rotations[:, chain[below]], rig.rotations[:, chain[below + 1]], place - below)


def _ignored(rig: Rig) -> str:
    used = {*rig.found.joints.values(), *rig.found.spine}
    names = [name for joint, name in enumerate(rig.skeleton.names) if joint not in used]
    return f"joints that only carry others, or are ignored: {', '.join(names)}" if names else ""


def _tpose_frames(bvh: Bvh, found: Found) -> int:
    """How many frames at the start are a T-pose and the run from it into the motion."""
    used = sorted({*found.joints.values(), *found.spine})
    rotations = bvh.rotations[:, used]
    if len(rotations) < 2:
        return 0
    first, second = np.degrees(angle(rotations[:2])).mean(axis=1)
    if first > _TPOSE_DEG or second < first + _TPOSE_DEG:
        return 0
    speeds = np.degrees(angle(multiply(inverse(rotations[:-1]), rotations[1:]))).mean(axis=1) * bvh.fps
    calm = speeds[1:] < _RUN_IN_DEG_S
    return 1 + int(np.argmax(calm)) if calm.any() else 1
