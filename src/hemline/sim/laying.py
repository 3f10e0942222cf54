"""The shape of the body on which a garment is laid before it settles."""

from typing import TYPE_CHECKING

from hemline.garments.garment import Garment
from hemline.meshes import crossing_edges

if TYPE_CHECKING:
    from hemline.bodies import ShapedBody

CROSSED_BY_DRESSING = 0.005
"""Edges that go through the cloth once it is dressed on another shape, over its triangles, from which on it is settled
on its own shape instead and follows the change of the body."""


def laid_on(garment: Garment, shaped: "ShapedBody") -> Garment:
    """A garment dressed on a shape; itself, on its own shape, where dressing would push it through itself.

    Args:
        garment: The garment, on any shape of the body.
        shaped: The shape on which it is to be worn.

    Raises:
        BadGarment: Another body than the one it was made on.
    """
    dressed = garment.dressed(shaped)
    crossed, before = (len(crossing_edges(each.vertices, each.faces)) for each in (dressed, garment))
    return dressed if crossed <= before + CROSSED_BY_DRESSING * len(dressed.faces) else garment
