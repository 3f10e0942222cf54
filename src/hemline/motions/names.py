"""Which joint of a foreign rig is which of ours."""

from dataclasses import dataclass

from hemline.errors import BadMotion

from .bvh import Skeleton

_PARTS = {
    "hip": ("upleg", "thigh", "upperleg", "hip"),
    "knee": ("leg", "shin", "calf", "lowleg", "lowerleg", "knee"),
    "ankle": ("foot", "ankle"),
    "shoulder": ("arm", "shldr", "upperarm", "uparm", "shoulder"),
    "elbow": ("forearm", "lowarm", "lowerarm", "elbow"),
    "wrist": ("hand", "wrist"),
}
_TOES = ("toebase", "toe", "toes", "ball")
_FINGER_BASES = ("fingerbase",)
_THUMBS = ("thumb", "thumb1", "handthumb1")


@dataclass(frozen=True)
class Found:
    """Joints of a rig by their role, as indices into its skeleton.

    Attributes:
        joints: Our joint name to the rig's joint, for all that the rig has; the three of the spine are left out.
        carriers: Joints from the root down to the pelvis, both included.
        spine: Joints from above the pelvis up to the one that carries the arms.
        thumbs: `left` and `right` to the first joint of the thumb, where there is one.
    """

    joints: dict[str, int]
    carriers: tuple[int, ...]
    spine: tuple[int, ...]
    thumbs: dict[str, int]


def find_joints(skeleton: Skeleton, file: str) -> Found:
    """Name the joints of a rig: limbs and head by their names, spine, neck and collars by the chains between them.

    Raises:
        BadMotion: A joint that is needed is missing.
    """
    plain = {_plain(name): index for index, name in reversed(list(enumerate(skeleton.names)))}
    joints = {"head": _needed("head", ("head",), plain, file)}
    thumbs = {}
    for side in ("left", "right"):
        for role, parts in _PARTS.items():
            joints[f"{side}_{role}"] = _needed(f"{side} {role}", _spellings(side, parts), plain, file)
        for role, parts in (("foot", _TOES), ("wrist", _FINGER_BASES)):
            joint = _first(_spellings(side, parts), plain)
            if joint is not None:
                joints[f"{side}_{role}"] = joint
        thumb = _first(_spellings(side, _THUMBS), plain)
        if thumb is not None:
            thumbs[side] = thumb
    lines = {name: _line(skeleton, joint) for name, joint in joints.items()}
    head, left, right = lines["head"], lines["left_shoulder"], lines["right_shoulder"]
    pelvis = max(set(head) & set(lines["left_hip"]) & set(lines["right_hip"]))
    chest = max(set(head) & set(left) & set(right))
    joints["pelvis"] = pelvis
    spine = tuple(joint for joint in head if pelvis < joint <= chest)
    if not spine:
        got = f"arms on '{skeleton.names[chest]}', which carries the legs"
        raise BadMotion(f"{file} lacks a joint of the spine", got, "add a spine between legs and arms")
    neck = [joint for joint in head if joint > chest and joint != joints["head"]]
    if neck:
        joints["neck"] = neck[0]
    for side, line in (("left", left), ("right", right)):
        collar = skeleton.parents[joints[f"{side}_shoulder"]]
        if collar != chest and collar in line:
            joints[f"{side}_collar"] = collar
    return Found(joints, tuple(joint for joint in head if joint <= pelvis), spine, thumbs)


def _plain(name: str) -> str:
    """Lower case, without a prefix such as `mixamorig:` and without marks."""
    return "".join(letter for letter in name.rsplit(":", 1)[-1].lower() if letter.isalnum())


def _spellings(side: str, parts: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(word for part in parts for word in (side + part, side[0] + part, part + side, part + side[0]))


def _first(spellings: tuple[str, ...], plain: dict[str, int]) -> int | None:
    return next((plain[word] for word in spellings if word in plain), None)


def _needed(role: str, spellings: tuple[str, ...], plain: dict[str, int], file: str) -> int:
    joint = _first(spellings, plain)
    if joint is None:
        cure = (
            f"name it '{spellings[0]}' or one of {', '.join(spellings[1:5])}"
            if len(spellings) > 1
            else "name it 'Head'"
        )
        raise BadMotion(f"{file} lacks the joint '{role}'", f"{len(plain)} other joints", cure)
    return joint


def _line(skeleton: Skeleton, joint: int) -> list[int]:
    """The joints from the root down to a joint, both included."""
    line = [joint]
    while skeleton.parents[line[-1]] >= 0:
        line.append(skeleton.parents[line[-1]])
    return line[::-1]
