"""Arrays and metadata of a close-fitting garment in a page, for all shapes of the body."""

import numpy as np

from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.own_body import refuse_other_body
from hemline.bodies import ShapedBody
from hemline.collide.close.close_cloth import STRETCH
from hemline.errors import BadInput
from hemline.meshes import rest_lengths

from .parts import PagePart, differences, short_numbers


def agentdress_part(model: AnimatorAgentDress, body: ShapedBody) -> PagePart:
    """Returns all tables of the model, from which the page computes the effect of a shape.

    Args:
        model: The model.
        body: The body that wears the garment, in any shape.

    Raises:
        BadInput: The body or the material is not that of the fit, or the pose model is rigging.
    """
    refuse_other_body(model, body)
    if model.materials is not None and model.garment.material != model.materials.own:
        got = model.garment.material.name
        cure = f"write it of the model in {model.materials.own.name}"
        raise BadInput("a page plays the material of the fit", got, cure)
    if model.tables.rigged is not None:
        cure = "fit it with --pose-model kernel"
        raise BadInput("a page plays a kernel as pose model", "a model of --pose-model sor", cure)
    edges, lengths = rest_lengths(model.garment.faces, model.garment.rest_edges)
    free, count = np.ones(len(model.garment.vertices), np.float32), len(model.tables.rest)
    free[model.garment.pins.vertices[np.isinf(model.garment.pins.stiffness)]] = 0
    arrays = model.tables.arrays() | {
        "basis.digits": differences(model.tables.basis.digits),
        "indices": model.tables.indices.astype(np.uint8),
        "faces": short_numbers(model.garment.faces, count),
        "limits.edges": short_numbers(edges, count),
        "limits.longest": (STRETCH * lengths).astype(np.float32),
        "limits.free": free,
    }
    config = model.config
    metadata = {
        "animator": "agentdress",
        "width": model.width,
        "shape_width": model.shape_width,
        "shape_model": config.shape_model,
        "decay_seconds": config.decay_seconds,
        "lift_deg": model.lift_deg,
        "beta_range": list(model.beta_range),
    } | config.blending
    return PagePart(arrays, metadata)
