"""Chains and capsules as VRM's spring bones."""

from hemline.export.character import DressedCharacter

_DOWN = [0.0, -1.0, 0.0]


def springs(character: DressedCharacter, first: int) -> dict:
    """Returns the extension `VRMC_springBone`: a spring per chain, a collider per capsule, one group of colliders.

    VRM stores the constants of a rope at its upper end, hemline at its lower end.

    Args:
        character: The character.
        first: Node of the first joint; the nodes of the chains follow the last joint.
    """
    chains, root = character.chains, first + len(character.joints)
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
            for bone in bones[1:]
        ]
        name = f"{character.name} {number:02d} on {character.joint_names[joint]}"
        spring_entries.append({"name": name, "joints": [*joints, {"node": root + bones[-1]}], "colliderGroups": [0]})
    return {
        "specVersion": "1.0",
        "colliders": _colliders(character, first),
        "colliderGroups": [{"name": "body", "colliders": list(range(len(character.capsules.joints)))}],
        "springs": spring_entries,
    }


def _colliders(character: DressedCharacter, first: int) -> list[dict]:
    """Returns each capsule in the frame of its joint, which is unrotated at rest."""
    capsules = character.capsules
    at = character.joints[capsules.joints]
    shapes = zip((capsules.starts - at).tolist(), (capsules.ends - at).tolist(), capsules.radii.tolist(), strict=True)
    return [
        {"node": first + joint, "shape": {"capsule": {"offset": start, "tail": end, "radius": radius}}}
        for joint, (start, end, radius) in zip(capsules.joints.tolist(), shapes, strict=True)
    ]
