"""The character that a body was made of, to be shown in its place."""

from pathlib import Path

import numpy as np

from hemline.bodies import read_skeleton
from hemline.bodies.body import ShapedBody
from hemline.errors import BadInput
from hemline.export import OwnMesh

_NEAR = 1e-3


def own_mesh(path: str | Path, body: ShapedBody) -> OwnMesh:
    """The file of a character, ready to be moved as the body that was made of it.

    Args:
        path: The `.glb`, `.vrm` or `.gltf` that the body was made of.
        body: That body.

    Raises:
        BadBody: The file cannot be read.
        BadInput: The body was not made of it.
    """
    found = read_skeleton(path, leg_length=body.leg_length)
    apart = float(np.linalg.norm(found.joints - body.joints, axis=1).max())
    if apart > _NEAR:
        cure = f"make the body of it: hemline body {path} -o BODY.safetensors"
        what = f"body '{body.body.name}' was not made of {path}"
        raise BadInput(what, f"joints that are {1000 * apart:.0f} mm apart", cure)
    return OwnMesh(found.rig.gltf, found.rig.nodes, found.rig.rest, found.to_body, found.owners)
