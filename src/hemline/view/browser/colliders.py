"""A mesh of the rounded cones that ropes collide with."""

import numpy as np

from hemline.arrays import Faces, Transforms, Vertices
from hemline.collide.primitives.body_primitives import BodyPrimitives

RINGS, AROUND = 6, 16
"""Number of rings at each end of a cone, from its tip to its side; number of vertices of a ring."""


def cone_surfaces(primitives: BodyPrimitives, transforms: Transforms) -> tuple[Vertices, Faces]:
    r"""Returns the surface of each cone.

    With n the normal, it is the sphere at end a where $n \cdot u \le (r_a - r_b) / l$, otherwise that at end b.

    Args:
        primitives: Rounded cones, as made by `BodyPrimitives.fit`.
        transforms: Skin transforms of the pose.

    Returns:
        Vertices in the world, float32 [m], and triangles, int32.
    """
    turns = np.asarray(transforms, np.float64)[primitives.joints]
    ends = np.stack([np.einsum("prc,pc->pr", turns[:, :, :3], primitives.shapes[:, at : at + 3]) for at in (0, 3)])
    ends += turns[:, :, 3]
    axis, radii = ends[1] - ends[0], primitives.shapes[:, 6:8]
    length = np.maximum(np.linalg.norm(axis, axis=1), 1e-9)
    along = axis / length[:, None]
    seam = np.arccos(np.clip((radii[:, 0] - radii[:, 1]) / length, -1.0, 1.0))
    fraction = np.linspace(0, 1, RINGS)
    tilts = np.concatenate([seam[:, None] * fraction, seam[:, None] + (np.pi - seam)[:, None] * fraction], axis=1)
    least = np.eye(3)[np.abs(along).argmin(axis=1)]
    across = np.cross(along, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    round_about = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    other = np.cross(along, across)
    ring = np.cos(round_about)[:, None] * across[:, None] + np.sin(round_about)[:, None] * other[:, None]
    normals = np.cos(tilts)[:, :, None, None] * along[:, None, None] + np.sin(tilts)[:, :, None, None] * ring[:, None]
    of_end = np.tile(np.repeat([1, 0], RINGS), (len(radii), 1))
    of_end[seam == 0], of_end[seam == np.pi] = 0, 1  # one end contains the other, and the cone is its sphere
    each = np.arange(len(radii))[:, None]
    points = ends[of_end, each][:, :, None] + radii[each, of_end][:, :, None, None] * normals
    return points.reshape(-1, 3).astype(np.float32), _faces(len(primitives.joints))


def _faces(cones: int) -> Faces:
    """Returns two triangles between neighbours of neighbouring rings, counter-clockwise from outside."""
    ring, at = np.meshgrid(np.arange(2 * RINGS - 1), np.arange(AROUND), indexing="ij")
    a, b = ring * AROUND + at, ring * AROUND + (at + 1) % AROUND
    one = np.concatenate([np.stack([a, a + AROUND, b], axis=-1), np.stack([b, a + AROUND, b + AROUND], axis=-1)])
    shifts = 2 * RINGS * AROUND * np.arange(cones)[:, None, None]
    return (one.reshape(-1, 3) + shifts).reshape(-1, 3).astype(np.int32)
