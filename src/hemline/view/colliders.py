"""The rounded cones that ropes collide with, as one mesh."""

import numpy as np

from hemline.arrays import Faces, Transforms, Vertices
from hemline.collide.primitives.proxy import BodyProxy

RINGS, AROUND = 6, 16
"""Rings of each end of a cone, from its tip to where the side begins; vertices of a ring."""


def cone_surfaces(proxy: BodyProxy, transforms: Transforms) -> tuple[Vertices, Faces]:
    r"""The surface of each cone: of the end a where its normal n has $n \cdot u \le (r_a - r_b) / l$, else of b.

    Args:
        proxy: Rounded cones alone, as `BodyProxy.fit` makes them.
        transforms: Skin transforms of the pose.

    Returns:
        Vertices in the world, float32 [m], and triangles, int32.
    """
    turns = np.asarray(transforms, np.float64)[proxy.joints]
    ends = np.stack([np.einsum("prc,pc->pr", turns[:, :, :3], proxy.shapes[:, at : at + 3]) for at in (0, 3)])
    ends += turns[:, :, 3]
    way, radii = ends[1] - ends[0], proxy.shapes[:, 6:8]
    length = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    along = way / length[:, None]
    meeting = np.arccos(np.clip((radii[:, 0] - radii[:, 1]) / length, -1.0, 1.0))
    share = np.linspace(0, 1, RINGS)
    tilts = np.concatenate([meeting[:, None] * share, meeting[:, None] + (np.pi - meeting)[:, None] * share], axis=1)
    least = np.eye(3)[np.abs(along).argmin(axis=1)]
    across = np.cross(along, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    round_about = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    other = np.cross(along, across)
    ring = np.cos(round_about)[:, None] * across[:, None] + np.sin(round_about)[:, None] * other[:, None]
    normals = np.cos(tilts)[:, :, None, None] * along[:, None, None] + np.sin(tilts)[:, :, None, None] * ring[:, None]
    of_end = np.tile(np.repeat([1, 0], RINGS), (len(radii), 1))
    of_end[meeting == 0], of_end[meeting == np.pi] = 0, 1  # one end holds the other, and the cone is its sphere
    each = np.arange(len(radii))[:, None]
    points = ends[of_end, each][:, :, None] + radii[each, of_end][:, :, None, None] * normals
    return points.reshape(-1, 3).astype(np.float32), _faces(len(proxy.joints))


def _faces(cones: int) -> Faces:
    """Two triangles between neighbours of neighbouring rings, outside counter-clockwise."""
    ring, at = np.meshgrid(np.arange(2 * RINGS - 1), np.arange(AROUND), indexing="ij")
    a, b = ring * AROUND + at, ring * AROUND + (at + 1) % AROUND
    one = np.concatenate([np.stack([a, a + AROUND, b], axis=-1), np.stack([b, a + AROUND, b + AROUND], axis=-1)])
    shifts = 2 * RINGS * AROUND * np.arange(cones)[:, None, None]
    return (one.reshape(-1, 3) + shifts).reshape(-1, 3).astype(np.int32)
