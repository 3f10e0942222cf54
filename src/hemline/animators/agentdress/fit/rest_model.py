"""The garment in the rest pose of a body of any shape: all betas of the body, not only those of the anchors."""

import numpy as np

from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.arrays import Faces, Int
from hemline.bodies.body import Body
from hemline.garments.clearance import smooth_field


def extend_to_all_betas(model: ShapeModel, body: Body, nearest: Int[np.ndarray, " verts"], faces: Faces) -> ShapeModel:
    """A shape model that knows all betas of the body: of those that it was not fitted to, the garment follows the skin.

    Args:
        model: Fitted to the first betas.
        body: The body.
        nearest: Vertex of the body under each of the garment's.
        faces: Triangles of the garment; what it follows is smoothed over them.
    """
    known, rows = len(model.effects) // 2, len(model.mean)
    linear = np.zeros((len(body.shapedirs), rows))
    linear[:known] = model.effects[:known]
    for beta in range(known, len(body.shapedirs)):
        moved = body.shapedirs[beta, nearest].astype(np.float64)
        linear[beta] = smooth_field(moved, faces, np.ones(len(nearest)), 1.0).ravel()
    squares = np.zeros_like(linear)
    squares[:known] = model.effects[known:]
    return ShapeModel(model.mean, np.concatenate([linear, squares]), model.explained)
