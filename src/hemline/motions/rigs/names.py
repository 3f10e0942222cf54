"""Matches the joints of a rig to the 24 joints: by the file's own map, by names, or by the shape of the tree."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from hemline.errors import BadMotion
from hemline.motions.bvh import Bvh, BvhSkeleton

from .bone_names import (
    FINGER_BASES,
    HEADS,
    MIDDLES,
    PARTS,
    THUMBS,
    TOES,
    VRM,
    VRM_MIDDLES,
    VRM_THUMBS,
    plain,
    spellings,
)
from .tree_lengths import joints_by_lengths
from .tree_shape import joints_by_shape


@dataclass(frozen=True)
class JointMatch:
    """Joints of a rig by their role, as indices into its skeleton.

    Attributes:
        joints: Joint of the rig for each of the 24 names that it has, without the three of the spine.
        carriers: Joints from the root down to the pelvis, both included.
        spine: Joints from above the pelvis up to the one that carries the arms.
        thumbs: First joint of the `left` and `right` thumb, if there is one.
        middles: First joint of the `left` and `right` middle finger, if there is one.
        how: A phrase that says how they were found; empty: by their names.
    """

    joints: dict[str, int]
    carriers: tuple[int, ...]
    spine: tuple[int, ...]
    thumbs: dict[str, int]
    middles: dict[str, int]
    how: str = ""


def find_joints(
    skeleton: BvhSkeleton, file: str, humanoid: Mapping[str, int] | None = None, bvh: Bvh | None = None
) -> JointMatch:
    """Matches the joints of a rig: limbs and head first, then spine, neck and collars by the chains between them.

    Limbs and head come from the file's own VRM map if there is one, else from known names, else from their places in
    the tree, which `JointMatch.how` then says.

    Args:
        skeleton: The rig.
        file: Name of the file in error messages.
        humanoid: Joint of each of VRM's bones, if the file has such a map.
        bvh: The clip of the rig, whose frames show its shape where the zero pose does not.

    Raises:
        BadMotion: A joint that is needed is missing.
    """
    if humanoid is not None:
        return _complete_match(skeleton, file, *_by_map(humanoid, file), how="the file's own VRM map")
    try:
        return _complete_match(skeleton, file, *_by_names(skeleton, file))
    except BadMotion as reason:
        joints = joints_by_shape(skeleton)
        if joints is None and bvh is not None:
            joints = joints_by_lengths(bvh)
        if joints is None:
            raise
        found = _complete_match(skeleton, file, joints, {}, {})
        return replace(found, how=f"their place in the tree, since {reason.what}: {_list_joints(skeleton, joints)}")


def _by_map(humanoid: Mapping[str, int], file: str) -> tuple[dict[str, int], dict[str, int], dict[str, int]]:
    joints = {ours: humanoid[theirs] for ours, theirs in VRM.items() if theirs in humanoid}
    for ours, theirs in VRM.items():
        if ours not in joints and not ours.endswith("_foot"):
            raise BadMotion(f"the VRM map of {file} lacks '{theirs}'", f"{len(humanoid)} bones", "export it again")
    sides = ("left", "right")
    fingers = [
        {side: humanoid[side + name] for side in sides for name in names[::-1] if side + name in humanoid}
        for names in (VRM_THUMBS, VRM_MIDDLES)
    ]
    return joints, fingers[0], fingers[1]


def _by_names(skeleton: BvhSkeleton, file: str) -> tuple[dict[str, int], dict[str, int], dict[str, int]]:
    known = {plain(name): index for index, name in reversed(list(enumerate(skeleton.names)))}
    joints = {"head": _require("head", HEADS, known, file)}
    thumbs, middles = {}, {}
    for side in ("left", "right"):
        for role, parts in PARTS.items():
            joints[f"{side}_{role}"] = _require(f"{side} {role}", spellings(side, parts), known, file)
        if joints[f"{side}_hip"] == joints[f"{side}_knee"]:  # 'LeftLeg' is the thigh where there is a 'LeftShin'
            shins = _first(spellings(side, tuple(part for part in PARTS["knee"] if part != "leg")), known)
            if shins is None:
                _require(f"{side} hip", spellings(side, PARTS["hip"][:-1]), known, file)
            else:
                joints[f"{side}_knee"] = shins
        for role, parts, before in (("foot", (*TOES, "foot"), "ankle"), ("wrist", FINGER_BASES, "")):
            joint = _first(spellings(side, parts), known)
            if joint is not None and joint != joints.get(f"{side}_{before}"):
                joints[f"{side}_{role}"] = joint
        for fingers, parts in ((thumbs, THUMBS), (middles, (*MIDDLES, "hand"))):
            joint = _first(spellings(side, parts), known)
            if joint is not None and joint != joints[f"{side}_wrist"]:
                fingers[side] = joint
    return joints, thumbs, middles


def _complete_match(
    skeleton: BvhSkeleton,
    file: str,
    joints: dict[str, int],
    thumbs: dict[str, int],
    middles: dict[str, int],
    *,
    how: str = "",
) -> JointMatch:
    """Adds pelvis, spine, neck and collars by the chains between limbs and head."""
    joints = dict(joints)
    lines = {name: _line(skeleton, joint) for name, joint in joints.items()}
    head, left, right = lines["head"], lines["left_shoulder"], lines["right_shoulder"]
    legs = set(lines["left_hip"]) & set(lines["right_hip"])
    if not (legs & set(head) and set(head) & set(left) & set(right)):
        raise BadMotion(f"head, arms and legs of {file} must be on one tree", "several", "join them under one root")
    pelvis, chest = max(set(head) & legs), max(set(head) & set(left) & set(right))
    joints["pelvis"] = pelvis
    spine = tuple(joint for joint in head if pelvis < joint <= chest)
    if not spine:
        got = f"arms on '{skeleton.names[chest]}', which carries the legs"
        raise BadMotion(f"{file} lacks a joint of the spine", got, "add a spine between legs and arms")
    neck = [joint for joint in head if joint > chest and joint != joints["head"]]
    if "neck" in plain(skeleton.names[chest]) and len(spine) > 1:  # old Bipeds, whose clavicles hang on the neck
        neck, spine = [chest], spine[:-1]
    if neck:
        joints["neck"] = neck[0]
    for side, line in (("left", left), ("right", right)):
        collar = skeleton.parents[joints[f"{side}_shoulder"]]
        if collar != chest and collar in line:
            joints[f"{side}_collar"] = collar
    carriers = tuple(joint for joint in head if joint <= pelvis)
    return JointMatch(joints, carriers, spine, dict(thumbs), dict(middles), how)


def _list_joints(skeleton: BvhSkeleton, joints: Mapping[str, int]) -> str:
    return ", ".join(f"{role} '{skeleton.names[joint]}'" for role, joint in joints.items())


def _first(words: tuple[str, ...], known: dict[str, int]) -> int | None:
    return next((known[word] for word in words if word in known), None)


def _require(role: str, words: tuple[str, ...], known: dict[str, int], file: str) -> int:
    joint = _first(words, known)
    if joint is None:
        others = f"name it '{words[0]}' or one of {', '.join(words[1:5])}"
        cure = others if len(words) > len(HEADS) else "name it 'Head'"
        raise BadMotion(f"{file} lacks the joint '{role}'", f"{len(known)} other joints", cure)
    return joint


def _line(skeleton: BvhSkeleton, joint: int) -> list[int]:
    """Returns the joints from the root down to a joint, both included."""
    line = [joint]
    while skeleton.parents[line[-1]] >= 0:
        line.append(skeleton.parents[line[-1]])
    return line[::-1]
