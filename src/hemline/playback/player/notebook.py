"""A frame in a notebook: a picture of the garment on its body, and a caption."""

from hemline.arrays import Faces
from hemline.garments.thumbnail import figure_html

from .frame import Frame

SIZE = (300, 400)
"""Width and height of the picture [pixels]."""


def frame_html(frame: Frame, faces: Faces, caption: str) -> str:
    """Returns a picture of a frame with a caption, as HTML.

    Args:
        frame: The frame.
        faces: Triangles of the garment.
        caption: Text below the picture.
    """
    from hemline.pictures import picture_of

    body = (frame.body.vertices, frame.body.shaped.body.faces, "body")
    return figure_html(picture_of([body, (frame.vertices, faces, "cloth")], size=SIZE), caption)
