"""Chains and capsules as VRM's spring bones."""

import math
from typing import Any

import numpy as np

from hemline.export.character import DressedCharacter
from hemline.springs import CapsuleColliders, SpringChains

LIMIT = "VRMC_springBone_limit"
"""Extension of joints that limits how far they swing; a draft in 2026."""
_DOWN = [0.0, -1.0, 0.0]


def springs(character: DressedCharacter, first: int) -> dict:
    """Returns the extension `VRMC_springBone`: a spring per chain, a collider per capsule.

    One group holds the colliders of all chains; a chain with colliders of its own has another group for them.

    VRM stores the constants of a bone at its upper end, hemline at its lower end.

    Args:
        character: The character.
        first: Node of the first joint; the nodes of the chains follow the last joint.
    """
    chains, root = character.chains, first + len(character.joints)
    groups = _groups(character.capsules)
    numbers = {chain: number for number, chain in enumerate(groups)}
    spring_entries = []
    for number, (bones, joint) in enumerate(zip(chains.spans, chains.joints.tolist(), strict=True)):
        joints = [
            {
                "node": root + bone - 1,
                "hitRadius": round(float(chains.radii[bone]), 5),
                "stiffness": round(float(chains.stiffness[bone]), 5),
                "gravityPower": round(float(chains.gravity[bone]), 5),
                "gravityDir": _DOWN,
                "dragForce": round(float(chains.drag[bone]), 5),
            }
            | _limit(chains, bone)
            for bone in bones[1:]
        ]
        name = f"{character.name} {number:02d} on {character.joint_names[joint]}"
        own = [numbers[chain] for chain in (-1, number) if chain in numbers]
        spring_entries.append({"name": name, "joints": [*joints, {"node": root + bones[-1]}], "colliderGroups": own})
    return {
        "specVersion": "1.0",
        "colliders": _colliders(character, first),
        "colliderGroups": [
            {"name": "body" if chain < 0 else f"legs for {chain:02d}", "colliders": colliders}
            for chain, colliders in groups.items()
        ],
        "springs": spring_entries,
    }


def _groups(capsules: CapsuleColliders) -> dict[int, list[int]]:
    """Returns the colliders of each chain that has its own, after those of all chains (-1)."""
    return {chain: np.flatnonzero(capsules.chains == chain).tolist() for chain in np.unique(capsules.chains).tolist()}


def is_limited(chains: SpringChains) -> bool:
    """Tells whether any bone of the chains has a limit."""
    return bool((chains.pitches < np.pi).any())


def _limit(chains: SpringChains, bone: int) -> dict[str, Any]:
    """Returns the extension with the limit of a joint; nothing if it has none.

    Format: https://github.com/vrm-c/vrm-specification/pull/496. The pitch of a spherical limit is the angle about the
    axis x of the bone, which is horizontal and along the body.
    """
    pitch, yaw, tilt = (float(each[bone]) for each in (chains.pitches, chains.yaws, chains.tilts))
    if pitch >= math.pi:
        return {}
    rotation = [round(math.sin(tilt / 2), 6), 0.0, 0.0, round(math.cos(tilt / 2), 6)]
    spherical = {"pitch": round(pitch, 5), "yaw": round(yaw, 5), "rotation": rotation}
    return {"extensions": {LIMIT: {"specVersion": "1.0-draft", "limit": {"spherical": spherical}}}}


def _colliders(character: DressedCharacter, first: int) -> list[dict]:
    """Returns each capsule in the frame of its joint, which is unrotated at rest."""
    capsules = character.capsules
    at = character.joints[capsules.joints]
    shapes = zip((capsules.starts - at).tolist(), (capsules.ends - at).tolist(), capsules.radii.tolist(), strict=True)
    return [
        {"node": first + joint, "shape": {"capsule": {"offset": start, "tail": end, "radius": radius}}}
        for joint, (start, end, radius) in zip(capsules.joints.tolist(), shapes, strict=True)
    ]
