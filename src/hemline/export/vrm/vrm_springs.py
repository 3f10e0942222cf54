"""Chains and capsules as VRM's spring bones."""

from hemline.export.character import DressedCharacter

_DOWN = [0.0, -1.0, 0.0]


def springs(character: DressedCharacter, first: int) -> dict:
    """The extension `VRMC_springBone`: a spring a chain, a collider a capsule, one group of all of them.

    VRM keeps the numbers of a rope at its upper end and moves its lower one; ours are those of the lower one.

    Args:
        character: Whose chains.
        first: Node of the first joint; those of the chains follow the last one.
    """
    chains, root = character.chains, first + len(character.joints)
    named = []
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
        named.append({"name": name, "joints": [*joints, {"node": root + bones[-1]}], "colliderGroups": [0]})
    return {
        "specVersion": "1.0",
        "colliders": _colliders(character, first),
        "colliderGroups": [{"name": "body", "colliders": list(range(len(character.capsules.joints)))}],
        "springs": named,
    }


def _colliders(character: DressedCharacter, first: int) -> list[dict]:
    """Each capsule in the frame of its joint, which is not turned at rest."""
    capsules = character.capsules
    at = character.joints[capsules.joints]
    shapes = zip((capsules.starts - at).tolist(), (capsules.ends - at).tolist(), capsules.radii.tolist(), strict=True)
    return [
        {"node": first + joint, "shape": {"capsule": {"offset": start, "tail": end, "radius": radius}}}
        for joint, (start, end, radius) in zip(capsules.joints.tolist(), shapes, strict=True)
    ]
