"""What a page holds of the body."""

import numpy as np

from hemline.bodies import ShapedBody
from hemline.bodies.body_file import shapedirs_in_steps

from .parts import short_numbers


def body_part(shaped: ShapedBody, *, shapes: bool) -> dict[str, np.ndarray]:
    """Mesh, joints and skin weights; the mesh is that of the shape.

    Args:
        shaped: The body.
        shapes: Also what its betas do, so that the page can give it other shapes.
    """
    body = shaped.body
    arrays = {
        "template": shaped.vertices,
        "joints": shaped.joints,
        "betas": shaped.betas,
        "faces": short_numbers(body.faces, len(body.template)),
        "weights": body.weights,
        "weight_indices": body.weight_indices.astype(np.uint8),
        "rest_offsets": body.rest_offsets,
        "parents": body.parents.astype(np.int8),
    }
    if shapes:
        arrays |= shapedirs_in_steps(body.shapedirs) | {"joint_shapedirs": body.joint_shapedirs}
    if body.posedirs is not None:
        arrays["posedirs"] = body.posedirs.astype(np.float16)
    return arrays
