"""Openings of a garment, and whether limbs go through them."""

from dataclasses import dataclass, field

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import boundary_loops, components

from .crossing_segment_kernels import crossings_of_segments
from .skeleton import Skeleton

SMALLEST = 0.12
"""Rims that are shorter are holes, not openings [m]."""


def rims_of(vertices: Vertices, faces: Faces) -> list["Rim"]:
    """The openings of a garment; the one rim of a sheet, such as a cape's, is none."""
    rims = [rim for loop in boundary_loops(faces) if (rim := Rim.of(loop, vertices)).length >= SMALLEST]
    part = components(faces, len(vertices))
    owner = [int(part[rim.loop[0]]) for rim in rims]
    return [rim for rim, each in zip(rims, owner, strict=True) if owner.count(each) > 1]


@dataclass(frozen=True, eq=False)
class Rim:
    """An opening of the garment."""

    loop: np.ndarray
    shares: np.ndarray
    """Of each vertex in the length of the rim."""
    length: float
    """Of the rim [m]."""
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    """The rim and its centre, once placed."""
    radius: float = 0.0

    @classmethod
    def of(cls, loop: np.ndarray, vertices: Vertices) -> "Rim":
        length = np.linalg.norm(vertices[loop] - vertices[np.roll(loop, -1)], axis=1)
        share = length + np.roll(length, 1)
        return cls(loop, share / share.sum(), float(length.sum()))

    def at(self, placed: Vertices) -> "Rim":
        points = placed[self.loop]
        centre = self.shares @ points
        return Rim(
            self.loop,
            self.shares,
            self.length,
            np.concatenate([points, centre[None]]),
            float(self.shares @ np.linalg.norm(points - centre, axis=1)),
        )

    def passed(self, skeleton: Skeleton) -> bool:
        """Whether a limb goes through it."""
        return bool(self.crossings(skeleton).any())

    def crossings(self, skeleton: Skeleton) -> Int[np.ndarray, " limbs"]:
        """How often each limb goes through the fan of triangles around its centre."""
        count, order = np.empty(len(skeleton.limbs), np.int64), np.arange(len(self.loop))
        fan = np.stack([order, np.roll(order, -1), np.full(len(order), len(order))], axis=1)
        crossings_of_segments(skeleton.points, skeleton.limbs, self.points, fan, count)
        return count
