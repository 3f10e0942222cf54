"""Arrays of the body in a page."""

import numpy as np

from hemline.bodies import ShapedBody
from hemline.bodies.body_file import shapedirs_in_steps

from .parts import short_numbers


def body_part(shaped: ShapedBody, *, shapes: bool) -> dict[str, np.ndarray]:
    """Returns mesh, joints and skin weights of a body in its shape.

    Args:
        shaped: The body.
        shapes: Whether to include the effect of betas, so that the page can change the shape.
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
