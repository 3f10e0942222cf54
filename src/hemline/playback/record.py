"""Recording of played frames, or of a simulated take, as a clip for export."""

from collections.abc import Callable, Iterable

import numpy as np

from hemline.animators.terms import garment_terms
from hemline.arrays import Faces, FramesOfVertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.datasets import Take
from hemline.export import Clip, ClipSkeleton
from hemline.garments.garment import Garment
from hemline.motions.motion import JOINT_NAMES, Motion
from hemline.motions.terms import as_stated
from hemline.playback.player.frame import Frame


def record(
    frames: Iterable[Frame],
    *,
    garment_name: str,
    garment_faces: Faces,
    motion: Motion,
    fps: float,
    keep: Callable[[Frame], None] | None = None,
) -> Clip:
    """Collects played frames in a clip for any export format.

    Args:
        frames: Frames, such as `play` yields.
        garment_name: Name of the garment's mesh.
        garment_faces: Triangles of the mesh.
        motion: The motion that was played, for its acknowledgment.
        fps: Frames per second.
        keep: Called with each frame.

    Returns:
        The clip: garment and body, (frames, verts, 3) each [m].
    """
    cloth: list[np.ndarray] = []
    bodies: list[PosedBody] = []
    terms: dict[str, None] = {}
    for frame in frames:
        cloth.append(frame.vertices)
        bodies.append(frame.body)
        terms |= dict.fromkeys(frame.terms)
        if keep is not None:
            keep(frame)
    return _clip(np.stack(cloth), garment_faces, bodies, motion, fps, garment_name, tuple(terms))


def record_take(take: Take, garment: Garment, body: ShapedBody, *, lead_in: bool = False) -> Clip:
    """Returns a simulated take as a clip, with the body of the simulation.

    Args:
        take: The take.
        garment: The garment of the take.
        body: The body at the betas of the take.
        lead_in: Whether to include the frames before the clip.
    """
    chosen = np.arange(len(take.motion)) if lead_in else take.clip_frames
    bodies = [body.posed(take.motion[int(i)]) for i in chosen]
    terms = garment_terms(garment)
    return _clip(take.vertices[chosen], garment.faces, bodies, take.motion, take.motion.fps, garment.name, terms)


def _clip(
    vertices: FramesOfVertices,
    faces: Faces,
    bodies: list[PosedBody],
    motion: Motion,
    fps: float,
    name: str,
    terms: tuple[str, ...],
) -> Clip:
    """Returns cloth and body; with the skeleton, formats that support skins store the body in half the size."""
    shaped = bodies[0].shaped
    body = shaped.body
    skeleton = (
        ClipSkeleton(
            shaped.joints,
            body.parents,
            np.stack([posed.transforms for posed in bodies]),
            shaped.vertices,
            body.weight_indices,
            body.weights,
            JOINT_NAMES,
        )
        if body.posedirs is None
        else None
    )
    return Clip(
        vertices=vertices,
        faces=faces,
        body_vertices=np.stack([posed.vertices for posed in bodies]),
        body_faces=body.faces,
        fps=fps,
        name=name,
        skeleton=skeleton,
        notices=as_stated((body.licence, *terms, motion.source, motion.licence)),
    )
