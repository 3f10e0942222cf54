"""Names of bones in rigs of many origins, one table for characters and clips.

Names are compared in lower case, without marks and without the prefixes below: `mixamorig:LeftUpLeg`, `thigh.L`,
`thigh_l`, `L_Hip`, `DEF-upper_arm.R`, `J_Bip_L_UpperLeg`, `Bip01 L Thigh`. A side is `left` or `l`, before or after.
"""

import re

PARTS = {
    "hip": ("upleg", "thigh", "upperleg", "upperleg01", "legupper", "hip", "leg"),
    "knee": ("knee", "leg", "shin", "calf", "lowleg", "lowerleg", "lowerleg01", "leglower"),
    "ankle": ("ankle", "foot"),
    "shoulder": ("arm", "shldr", "upperarm", "uparm", "upperarm01", "armupper", "shoulder"),
    "elbow": ("forearm", "lowarm", "lowerarm", "lowerarm01", "armlower", "elbow"),
    "wrist": ("wrist", "hand", "palm"),
}
"""Names of the limb joints that every rig must have, without their side. Mixamo's `LeftShoulder` is a collar, SMPL's is
the arm, so the arm comes before the shoulder. If a rig has ankle and foot, or wrist and hand, the second is the next
joint."""

HEADS = ("head", "chead")
TOES = ("toebase", "toe", "toes", "ball", "toe0", "toe11")
FINGER_BASES = ("fingerbase",)
THUMBS = (
    "thumb",
    "thumb1",
    "thumb01",
    "handthumb1",
    "thumbmetacarpal",
    "thumbproximal",
    "finger0",
    "finger11",
)
MIDDLES = ("middle", "middle1", "middle01", "fmiddle01", "handmiddle1", "middleproximal", "finger2", "finger31")
"""Names of the first joint of the middle finger."""

_PREFIXES = re.compile(r"^(mixamorig\d*|bip0*1|bip001|valvebipedbip01|jbip|def|org|mch|ccbase|mavg|favg|character1)")

VRM = {"head": "head"} | {
    f"{side}_{ours}": f"{side}{theirs}"
    for side in ("left", "right")
    for ours, theirs in {
        "hip": "UpperLeg",
        "knee": "LowerLeg",
        "ankle": "Foot",
        "shoulder": "UpperArm",
        "elbow": "LowerArm",
        "wrist": "Hand",
        "foot": "Toes",
    }.items()
}
"""VRM's bone of each joint; spine, neck and collars are found between them."""

VRM_THUMBS = ("ThumbMetacarpal", "ThumbProximal")
"""First joint of the thumb in VRM 1.0 and in VRM 0.x."""
VRM_MIDDLES = ("MiddleProximal",)


def plain(name: str) -> str:
    """Returns a bone's name in lower case, without punctuation and the usual prefixes of rigs."""
    letters = "".join(letter for letter in re.split(r"[:|]", name)[-1].lower() if letter.isalnum())
    return _PREFIXES.sub("", letters) or letters


def spellings(side: str, parts: tuple[str, ...]) -> tuple[str, ...]:
    """Returns all plain names of a joint of one side, the likeliest first."""
    return tuple(word for part in parts for word in (side + part, side[0] + part, part + side, part + side[0]))
