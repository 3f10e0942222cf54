"""Tells a rigged character from a garment that was skinned to the same bones."""

from pathlib import Path

import numpy as np

from hemline.errors import BadBody
from hemline.motions import JOINT_NAMES
from hemline.motions.rigs.gltf_rig import read_rig

from .character import owners_of
from .character_mesh import read_character_mesh

_PAIRS = (("wrist", "hand"), ("ankle", "foot"))
_ENDS = (("head",), *((f"{side}_{a}", f"{side}_{b}") for side in ("left", "right") for a, b in _PAIRS))
"""Joints, one of each group of which moves vertices of a character most; sleeves and legs of garments end before."""


def is_character(path: str | Path) -> bool:
    """Whether a file holds a humanoid whose bones move a head, both hands and both feet.

    A garment may bring the whole armature of its character, but no skin at its ends.

    Args:
        path: A `.glb`, `.vrm`, `.gltf` or `.fbx`.
    """
    try:
        rig = read_rig(path, error=BadBody, skinned=True)
        mesh = read_character_mesh(rig, owners_of(rig)[0])
    except BadBody:
        return False
    used = np.unique(mesh.faces)
    most = {JOINT_NAMES[joint] for joint in np.unique(mesh.weights[used].argmax(axis=1))}
    return all(most & set(ends) for ends in _ENDS)
