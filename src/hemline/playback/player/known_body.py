"""The body as an animator knows it: as it is, or without the accessories that it carries."""

import warnings

import numpy as np

from hemline.animators.base import Animator
from hemline.bodies import ShapedBody
from hemline.errors import BadModel, HemlineWarning
from hemline.meshes import ClosestTree

DEEP = 0.03
"""Depth of a garment at rest in an accessory above which a warning is given [m]."""


def known_body(animator: Animator, body: ShapedBody) -> ShapedBody:
    """Returns a body as an animator knows it, and warns if its garment lies deep in an accessory of that body.

    Args:
        animator: A fitted animator.
        body: The body to play on.

    Raises:
        BadModel: The animator was fitted on another kind of body.
    """
    if body.body.name == animator.body_name:
        return body
    if body.bare.body.name != animator.body_name:
        raise BadModel(
            f"the model was fitted on body '{animator.body_name}'",
            f"body '{body.body.name}'",
            "load that body, or fit again",
        )
    depth = _depth_in_accessories(animator, body)
    if depth > DEEP:
        what = f"the model of '{animator.garment.name}' does not know the accessories of this body"
        got = f"they reach {100 * depth:.0f} cm deep through it, and it is only pushed out of them"
        cure = "play it by live (animate --garment), or simulate and fit it on this body"
        warnings.warn(HemlineWarning(what, got, cure), stacklevel=3)
    return body.bare


def _depth_in_accessories(animator: Animator, body: ShapedBody) -> float:
    """Returns how deep the garment as it was made lies in the accessories of a body at rest [m]."""
    faces = body.body.faces
    accessories = faces[faces[:, 0] >= len(body.bare.vertices)]
    shaped = body.body.shaped(animator.garment.body_betas)
    tree = ClosestTree(shaped.vertices.astype(np.float64), accessories)
    return float(-tree.signed_distances(animator.garment.vertices.astype(np.float64)).min())
