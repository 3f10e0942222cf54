"""A picture of the worst frame beside the truth."""

from pathlib import Path

import numpy as np

from hemline import pictures

from .evaluate import Evaluation


def draw_worst(path: Path, evaluation: Evaluation, faces: np.ndarray) -> None:
    """Write a PNG of the worst frame: ours, and beside it the truth where there is one.

    Args:
        path: The PNG.
        evaluation: What `evaluate` returned.
        faces: Triangles of the garment.
    """
    frame = evaluation.worst
    body_faces = frame.body.shaped.body.faces
    body = (frame.body.vertices, body_faces)
    pictures.compare(path, frame.vertices, evaluation.worst_truth, faces, body=body)
