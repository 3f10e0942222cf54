"""Frames of a clip gathered for export."""

from collections.abc import Callable, Iterable

import numpy as np

from hemline.bodies.shaped import ShapedBody
from hemline.datasets import Take
from hemline.export import Clip
from hemline.garments.garment import Garment
from hemline.motions.motion import Motion

from .play import Frame


def record(
    frames: Iterable[Frame],
    *,
    garment_name: str,
    garment_faces: np.ndarray,
    motion: Motion,
    fps: float,
    keep: Callable[[Frame], None] | None = None,
) -> Clip:
    """Gather played frames into a clip that every export format takes.

    Args:
        frames: What `play` yields.
        garment_name: Name of the garment's mesh.
        garment_faces: Its triangles.
        motion: The motion that was played, for its acknowledgment.
        fps: Frames a second of the frames.
        keep: Called with each frame, for figures.

    Returns:
        The clip: garment and body, (frames, verts, 3) each [m].
    """
    cloth, body, faces, licence = [], [], np.zeros((0, 3), np.int32), ""
    for frame in frames:
        cloth.append(frame.vertices)
        body.append(frame.body.vertices)
        faces, licence = frame.body.shaped.body.faces, frame.body.shaped.body.licence
        if keep is not None:
            keep(frame)
    return Clip(
        vertices=np.stack(cloth), faces=garment_faces, body_vertices=np.stack(body), body_faces=faces, fps=fps,
        name=garment_name, notices=tuple(text for text in (licence, motion.source, motion.licence) if text),
    )  # fmt: skip


def recorded_take(take: Take, garment: Garment, body: ShapedBody, *, lead_in: bool = False) -> Clip:
    """A simulated take as a clip, with the body it was simulated against.

    Args:
        take: The take.
        garment: Its garment.
        body: The body at the take's betas.
        lead_in: Keep the frames before the clip.
    """
    chosen = np.arange(len(take.motion)) if lead_in else take.clip_frames
    skinned = np.stack([body.posed(take.motion[int(i)]).vertices for i in chosen])
    notices = (body.body.licence, take.motion.source, take.motion.licence)
    return Clip(
        vertices=take.vertices[chosen], faces=garment.faces, body_vertices=skinned, body_faces=body.body.faces,
        fps=take.motion.fps, name=garment.name, notices=tuple(text for text in notices if text),
    )  # fmt: skip
