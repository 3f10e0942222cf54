"""Arrays and metadata of a close-fitting garment in a page, for all shapes of the body."""

import numpy as np

from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.own_body import refuse_other_body
from hemline.bodies import ShapedBody
from hemline.collide import EdgeLimits
from hemline.errors import BadInput

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
    limits, count = EdgeLimits.of(model.garment), len(model.tables.rest)
    arrays = model.tables.arrays() | {
        "basis.digits": differences(model.tables.basis.digits),
        "indices": model.tables.indices.astype(np.uint8),
        "faces": short_numbers(model.garment.faces, count),
        "limits.edges": short_numbers(limits.edges, count),
        "limits.longest": limits.longest,
        "limits.free": limits.free,
    }
    config = model.config
    metadata = {
        "animator": "agentdress",
        "width": model.width,
        "shape_width": model.shape_width,
        "shape_model": config.shape_model,
        "decay_seconds": config.decay_seconds,
        "beta_range": list(model.beta_range),
    } | config.blending
    return PagePart(arrays, metadata)
