"""Shape model of the garment in the rest pose, for all betas of the body rather than only those of the anchors."""

import numpy as np

from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.arrays import Faces, Int
from hemline.bodies.body import Body
from hemline.garments.clearance import smooth_field


def extend_to_all_betas(model: ShapeModel, body: Body, nearest: Int[np.ndarray, " verts"], faces: Faces) -> ShapeModel:
    """Extends a shape model to all betas of the body. For the additional betas the garment follows the skin.

    Args:
        model: Shape model of the first betas.
        body: The body.
        nearest: Closest body vertex of each garment vertex.
        faces: Triangles of the garment, over which the motion of the skin is smoothed.
    """
    known, rows = len(model.effects) // 2, len(model.mean)
    linear = np.zeros((len(body.shapedirs), rows))
    linear[:known] = model.effects[:known]
    for beta in range(known, len(body.shapedirs)):
        displacement = body.shapedirs[beta, nearest].astype(np.float64)
        linear[beta] = smooth_field(displacement, faces, np.ones(len(nearest)), 1.0).ravel()
    squares = np.zeros_like(linear)
    squares[:known] = model.effects[known:]
    return ShapeModel(model.mean, np.concatenate([linear, squares]), model.explained)
