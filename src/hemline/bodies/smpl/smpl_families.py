"""Joints of SMPL, SMPL-H and SMPL-X, and their reduction to 24."""

from dataclasses import dataclass

from hemline.motions import JOINT_NAMES, PARENTS

_BODY_JOINTS = 22
_AT = JOINT_NAMES.index
_TERMS = "for non-commercial research only unless licensed; its makers' terms hold for all that is made of it"


@dataclass(frozen=True)
class Family:
    """A kind of body model.

    Attributes:
        name: Name of the kind.
        parents: Parent of each of its joints, -1 for the pelvis.
        reduced: The one of the 24 joints into which each of its joints is merged.
        pivots: Joint of the family about which each of the 24 turns.
        licence: Where the terms are published.
    """

    name: str
    parents: tuple[int, ...]
    reduced: tuple[int, ...]
    pivots: tuple[int, ...]
    licence: str


def _with_fingers(name: str, face: int, site: str) -> Family:
    """Makes a family with `face` joints on the head, then five fingers of three joints on each hand.

    Index, middle, little and ring finger become the hand, which turns about the middle finger's first joint; the
    thumb becomes the wrist.
    """
    parents, reduced = [*PARENTS[:_BODY_JOINTS]], [*range(_BODY_JOINTS)]
    parents += [_AT("head")] * face
    reduced += [_AT("head")] * face
    pivots = [*range(_BODY_JOINTS)]
    for side in ("left", "right"):
        wrist, hand = _AT(f"{side}_wrist"), _AT(f"{side}_hand")
        pivots.append(len(parents) + 3)
        for finger in ("index", "middle", "little", "ring", "thumb"):
            parents += [wrist, len(parents), len(parents) + 1]
            reduced += [wrist if finger == "thumb" else hand] * 3
    return Family(name, tuple(parents), tuple(reduced), tuple(pivots), f"{name} ({site}): {_TERMS}")


_ALL = (
    Family("SMPL", PARENTS, tuple(range(24)), tuple(range(24)), f"SMPL (smpl.is.tue.mpg.de): {_TERMS}"),
    _with_fingers("SMPL-H", 0, "mano.is.tue.mpg.de"),
    _with_fingers("SMPL-X", 3, "smpl-x.is.tue.mpg.de"),
)
FAMILIES: dict[int, Family] = {len(family.parents): family for family in _ALL}
"""Families by their number of joints: 24, 52, 55."""
