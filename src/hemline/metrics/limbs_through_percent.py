"""Percentage of limbs whose bone goes through the cloth: a leg through a skirt, an arm caught in it."""

from collections.abc import Sequence

import numpy as np

from hemline.arrays import BodyFaces, BodyVertices, Bool, Faces, Float, Vertices
from hemline.meshes import segment_crossings


def limbs_through(
    bones: Float[np.ndarray, "limbs 2 3"],
    vertices: Vertices,
    faces: Faces,
    body_vertices: BodyVertices,
    body_faces: BodyFaces,
) -> Bool[np.ndarray, " limbs"]:
    """Tells for each limb whether its bone goes through the cloth in one frame.

    Cloth can be whole, and all of its vertices outside the body, with a leg stuck through it. So neither stretch nor
    vertices inside the body tell of such a limb, but its bone does: whatever a garment does, no bone crosses it.

    A bone that also goes through skin lies in another part of the body, as the forearm of a hanging arm may lie in the
    thigh. Cloth cannot be outside of both, so such a limb does not count.

    Args:
        bones: Both ends of each bone, as `bodies.limb_bones` gives them [m].
        vertices: The garment [m].
        faces: Triangles of the garment.
        body_vertices: The posed body [m].
        body_faces: Triangles of the body.
    """
    through = segment_crossings(bones, vertices, faces) > 0
    through[through] = segment_crossings(bones[through], body_vertices, body_faces) == 0
    return through


def limbs_through_figures(
    frames: Sequence[Bool[np.ndarray, " limbs"]], names: Sequence[str]
) -> dict[str, float | str | None]:
    """Summarises `limbs_through` over a clip.

    Args:
        frames: `limbs_through` of each frame.
        names: Name of each limb.

    Returns:
        `mean`: limbs through the cloth, of all limbs in all frames [percent]; `frames`: frames with such a limb
        [percent]; `worst_limb_percent`: frames in which the limb that is through most often is through [percent];
        `worst_limb`: name of that limb, None if no limb is ever through.

    Example:
        >>> limbs_through_figures([np.array([True, False]), np.array([False, False])], ["left thigh", "right thigh"])
        {'mean': 25.0, 'frames': 50.0, 'worst_limb_percent': 50.0, 'worst_limb': 'left thigh'}
    """
    every = np.asarray(frames, bool)
    by_limb = every.mean(axis=0)
    worst = int(by_limb.argmax())
    return {
        "mean": 100 * float(every.mean()),
        "frames": 100 * float(every.any(axis=1).mean()),
        "worst_limb_percent": 100 * float(by_limb[worst]),
        "worst_limb": names[worst] if by_limb[worst] > 0 else None,
    }
