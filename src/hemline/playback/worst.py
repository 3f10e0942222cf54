"""A picture of the worst frame of an evaluation, beside the simulation."""

from pathlib import Path

import numpy as np

from hemline import pictures

from .evaluate import Evaluation


def draw_worst(path: Path, evaluation: Evaluation, faces: np.ndarray) -> None:
    """Writes a PNG of the worst frame, beside the simulated one where there is one.

    Args:
        path: Path of the PNG.
        evaluation: Result of `evaluate`.
        faces: Triangles of the garment.
    """
    frame = evaluation.worst
    body_faces = frame.body.shaped.body.faces
    body = (frame.body.vertices, body_faces)
    pictures.compare(path, frame.vertices, evaluation.worst_truth, faces, body=body)
