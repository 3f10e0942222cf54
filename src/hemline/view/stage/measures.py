"""Measures of a frame: stretch and error of triangles, vertices inside the body, and the worst frames of a clip."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Mask, Vertices
from hemline.collide import inside
from hemline.garments import Garment
from hemline.meshes import edge_strains
from hemline.metrics import vertex_errors_mm
from hemline.playback import Frame

STAGES = ("finished", "before the projection", "the animator's own")
"""Stages of a frame that can be shown."""
WORST_COUNT = 5
"""Number of frames that are listed for each measure."""


def cloth_of(frame: Frame, stage: str) -> Vertices:
    """Returns the garment of a frame, finished or at an earlier stage (verts, 3) [m].

    Args:
        frame: A frame.
        stage: One of `STAGE_DIVISORS`.
    """
    return (frame.vertices, frame.before_projection, frame.animated)[STAGES.index(stage)]


def stretches(vertices: Vertices, garment: Garment) -> Float[np.ndarray, " faces"]:
    """Returns the largest stretch of an edge of each triangle, at least 0 [percent]."""
    return 100 * np.maximum(edge_strains(vertices, garment.faces, garment.rest_edges).max(axis=1), 0)


def errors(vertices: Vertices, truth: Vertices, garment: Garment) -> Float[np.ndarray, " faces"]:
    """Returns the distance to the simulation, as the mean over the corners of each triangle [mm]."""
    return vertex_errors_mm(vertices, truth)[garment.faces].mean(axis=1)


def inside_body(vertices: Vertices, frame: Frame) -> Mask:
    """Returns which vertices are inside the body of a frame (winding number above 0.5)."""
    return inside(frame.body.vertices, frame.body.faces, vertices)


@dataclass(frozen=True)
class FrameMeasures:
    """Measures of one frame."""

    index: int
    stretch: float
    """Largest stretch of an edge that is shown [percent]."""
    inside: int
    """Number of vertices inside the body before the projection."""


def measure_frame(index: int, frame: Frame, garment: Garment) -> FrameMeasures:
    """Measures a frame.

    Args:
        index: Number of the frame.
        frame: The frame.
        garment: The garment.
    """
    worst = float(stretches(frame.vertices, garment).max())
    return FrameMeasures(index, worst, int(np.count_nonzero(inside_body(frame.before_projection, frame))))


def worst_frames(measured: list[FrameMeasures]) -> list[tuple[int, str]]:
    """Returns the frames with the largest stretch, then those with the most vertices inside.

    Args:
        measured: The measures of all frames.

    Returns:
        The number of each frame, and a line that says what is wrong.
    """
    long = sorted(measured, key=lambda each: -each.stretch)[:WORST_COUNT]
    deep = sorted((each for each in measured if each.inside), key=lambda each: -each.inside)[:WORST_COUNT]
    return [(each.index, f"frame {each.index}: an edge {each.stretch:.0f} % too long") for each in long] + [
        (each.index, f"frame {each.index}: {each.inside} inside before the projection") for each in deep
    ]
