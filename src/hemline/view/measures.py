"""What the page tells of a frame: stretch and error of triangles, vertices inside the body, the worst frames."""

from dataclasses import dataclass

import numpy as np

from hemline.arrays import Float, Mask, Vertices
from hemline.collide import inside
from hemline.garments import Garment
from hemline.meshes import edge_strains
from hemline.metrics import vertex_errors_mm
from hemline.playback import Frame

STAGES = ("finished", "before the projection", "the animator's own")
"""What can be shown of a frame."""
WORST_COUNT = 5
"""Frames that are listed for each measure."""


def cloth_of(frame: Frame, shown: str) -> Vertices:
    """The garment of a frame: finished, or what an earlier stage made of it [m].

    Args:
        frame: A frame.
        shown: One of `STAGES`.
    """
    return (frame.vertices, frame.held, frame.animated)[STAGES.index(shown)]


def stretches(vertices: Vertices, garment: Garment) -> Float[np.ndarray, " faces"]:
    """Stretch of the longest edge of each triangle, 0 where none is longer than at rest [percent]."""
    return 100 * np.maximum(edge_strains(vertices, garment.faces, garment.rest_edges).max(axis=1), 0)


def errors(vertices: Vertices, truth: Vertices, garment: Garment) -> Float[np.ndarray, " faces"]:
    """Distance to the simulation, the mean of each triangle's corners [mm]."""
    return vertex_errors_mm(vertices, truth)[garment.faces].mean(axis=1)


def inside_body(vertices: Vertices, frame: Frame) -> Mask:
    """Which vertices are inside the body of a frame [winding number above 0.5]."""
    return inside(frame.body.vertices, frame.body.faces, vertices)


@dataclass(frozen=True)
class FrameMeasures:
    """A frame's measures."""

    index: int
    stretch: float
    """Of the most stretched edge that is shown [percent]."""
    inside: int
    """Vertices inside the body before the projection."""


def measure_frame(index: int, frame: Frame, garment: Garment) -> FrameMeasures:
    """Measure a frame.

    Args:
        index: Its number.
        frame: The frame.
        garment: What is worn.
    """
    worst = float(stretches(frame.vertices, garment).max())
    return FrameMeasures(index, worst, int(np.count_nonzero(inside_body(frame.held, frame))))


def worst_frames(every: list[FrameMeasures]) -> list[tuple[int, str]]:
    """The frames with the largest stretch, then those with most vertices inside: their numbers, and what is wrong.

    Args:
        every: Frames that were measured.
    """
    long = sorted(every, key=lambda each: -each.stretch)[:WORST_COUNT]
    deep = sorted((each for each in every if each.inside), key=lambda each: -each.inside)[:WORST_COUNT]
    return [(each.index, f"frame {each.index}: an edge {each.stretch:.0f} % too long") for each in long] + [
        (each.index, f"frame {each.index}: {each.inside} inside before the projection") for each in deep
    ]
