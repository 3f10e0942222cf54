"""Names of joints in VRM, and its metadata about licences."""

VRM_BONES = {
    "pelvis": "hips",
    "spine1": "spine",
    "spine2": "chest",
    "spine3": "upperChest",
    "neck": "neck",
    "head": "head",
} | {
    f"{side}_{ours}": f"{side}{theirs}"
    for side in ("left", "right")
    for ours, theirs in {
        "collar": "Shoulder",
        "shoulder": "UpperArm",
        "elbow": "LowerArm",
        "wrist": "Hand",
        "hip": "UpperLeg",
        "knee": "LowerLeg",
        "ankle": "Foot",
        "foot": "Toes",
    }.items()
}
"""Bone of VRM for each joint; the joints at the knuckles have none."""

_LICENCE = "https://vrm.dev/licenses/1.0/"
_CC0 = "https://creativecommons.org/publicdomain/zero/1.0/"
_FREE = {
    "avatarPermission": "everyone",
    "allowExcessivelyViolentUsage": True,
    "allowExcessivelySexualUsage": True,
    "allowPoliticalOrReligiousUsage": True,
    "allowAntisocialOrHateUsage": True,
    "allowRedistribution": True,
    "commercialUsage": "corporation",
    "creditNotation": "unnecessary",
    "modification": "allowModificationRedistribution",
    "otherLicenseUrl": _CC0,
}
"""Permissions of CC0, which allows everything, as metadata of VRM."""
_OWN = {
    "avatarPermission": "onlyAuthor",
    "allowExcessivelyViolentUsage": False,
    "allowExcessivelySexualUsage": False,
    "allowPoliticalOrReligiousUsage": False,
    "allowAntisocialOrHateUsage": False,
    "allowRedistribution": False,
    "commercialUsage": "personalNonProfit",
    "creditNotation": "required",
    "modification": "prohibited",
}
"""Least permissions that VRM can state, for bodies under any other licence."""


def humanoid(names: tuple[str, ...], first: int) -> dict[str, dict]:
    """Returns the node of each bone of VRM that the body has.

    Args:
        names: Names of the joints.
        first: Node of the first joint.
    """
    return {VRM_BONES[name]: {"node": first + joint} for joint, name in enumerate(names) if name in VRM_BONES}


def meta(name: str, notices: tuple[str, ...]) -> dict:
    """Returns the metadata of VRM about permissions, from the licence of the body, the first of the notices."""
    rights = _FREE if notices and notices[0].startswith("CC0") else _OWN
    licences = {"thirdPartyLicenses": "; ".join(notices)} if notices else {}
    return {"name": name, "version": "1", "authors": ["hemline"], "licenseUrl": _LICENCE} | licences | rights
