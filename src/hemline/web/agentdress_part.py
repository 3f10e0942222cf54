"""What a page holds of a close-fitting garment, for all shapes of the body."""

import numpy as np

from hemline.animators.agentdress.model import AnimatorAgentDress
from hemline.animators.own_body import refuse_other_body
from hemline.bodies import ShapedBody
from hemline.errors import BadInput

from .parts import Part, differences, short_faces

_LEFT_OUT = ("basis.digits", "clearances", "nearest")


def agentdress_part(model: AnimatorAgentDress, body: ShapedBody) -> Part:
    """All tables of the model; the page makes of them what a shape does.

    Args:
        model: The model.
        body: The body that wears it, in any shape.

    Raises:
        BadInput: Another body than that of the fit; a pose model that is rigging, or clearances that the model keeps.
    """
    refuse_other_body(model, body)
    if model.tables.rigged is not None:
        raise BadInput("a page plays kernels as pose models", "a model with --pose-model sor", "fit it with 'kernel'")
    if model.config.clearance > 0:
        cure = "fit it with --clearance 0"
        raise BadInput("a page keeps no clearances of its own", f"--clearance {model.config.clearance:g}", cure)
    arrays = {name: array for name, array in model.tables.arrays().items() if name not in _LEFT_OUT}
    arrays |= {
        "basis.digits": differences(model.tables.basis.digits),
        "indices": model.tables.indices.astype(np.uint8),
        "nearest": model.tables.nearest,
        "faces": short_faces(model.garment.faces, len(model.tables.rest)),
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
    return Part(arrays, metadata)
