"""The mesh of the character from which a body was made, to be shown in place of the body."""

from pathlib import Path

import numpy as np

from hemline.bodies import read_skeleton
from hemline.bodies.body import ShapedBody
from hemline.errors import BadInput
from hemline.export import OwnMesh

_JOINT_TOLERANCE = 1e-3
"""Largest distance between joints of a body and of its character [m]."""


def own_mesh(path: str | Path, body: ShapedBody) -> OwnMesh:
    """Reads a character and binds its nodes to the joints of the body that was made from it.

    Args:
        path: The `.glb`, `.vrm` or `.gltf` file of the character.
        body: The body that was made from it.

    Raises:
        BadBody: The file cannot be read.
        BadInput: The body was not made from this file.
    """
    skeleton = read_skeleton(path, leg_length=body.leg_length)
    apart = float(np.linalg.norm(skeleton.joints - body.joints, axis=1).max())
    if apart > _JOINT_TOLERANCE:
        cure = f"make the body of it: hemline body {path} -o BODY.safetensors"
        what = f"body '{body.body.name}' was not made of {path}"
        raise BadInput(what, f"joints that are {1000 * apart:.0f} mm apart", cure)
    return OwnMesh(skeleton.rig.gltf, skeleton.rig.nodes, skeleton.rig.rest, skeleton.to_body, skeleton.owners)
