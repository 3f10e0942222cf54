"""Openings of a garment, which are rims of its mesh, and the limbs that go through them."""

from dataclasses import dataclass, field

import numpy as np

from hemline.arrays import Faces, Int, Vertices
from hemline.meshes import open_rims, sheets
from hemline.meshes.edges import directed_edges
from hemline.meshes.segment_crossing_kernels import crossings_of_segments

from .skeleton import Skeleton

SHORTEST_RIM = 0.12
"""Rims shorter than this are small holes, such as buttonholes, and not openings for limbs [m]."""


def rims_of(vertices: Vertices, faces: Faces) -> list["Rim"]:
    """Returns the openings of a garment; the only rim of a sheet, such as a cape or a pocket, is no opening."""
    rims = [rim for loop in open_rims(faces) if (rim := Rim.of(loop, vertices)).length >= SHORTEST_RIM]
    sheet, edges = sheets(faces), directed_edges(faces)
    at_edge = dict(zip(map(tuple, edges.tolist()), (np.arange(len(edges)) % len(faces)).tolist(), strict=True))
    # a rim runs against the direction of its triangles
    owner = [int(sheet[at_edge[int(rim.loop[1]), int(rim.loop[0])]]) for rim in rims]
    return [rim for rim, each in zip(rims, owner, strict=True) if owner.count(each) > 1]


@dataclass(frozen=True, eq=False)
class Rim:
    """An opening of the garment."""

    loop: np.ndarray
    """Vertices of the rim, in order."""
    fractions: np.ndarray
    """Fraction of the length of the rim at each vertex."""
    length: float
    """Length of the rim [m]."""
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    """Positions of the rim's vertices, then of its centre; empty until `at` places it [m]."""
    radius: float = 0.0
    """Mean distance of the rim from its centre, once it is placed [m]."""

    @classmethod
    def of(cls, loop: np.ndarray, vertices: Vertices) -> "Rim":
        """Makes the opening of a rim of a mesh."""
        length = np.linalg.norm(vertices[loop] - vertices[np.roll(loop, -1)], axis=1)
        fractions = length + np.roll(length, 1)
        return cls(loop, fractions / fractions.sum(), float(length.sum()))

    def at(self, placed: Vertices) -> "Rim":
        """Returns the opening for other positions of the mesh [m]."""
        points = placed[self.loop]
        centre = self.fractions @ points
        return Rim(
            self.loop,
            self.fractions,
            self.length,
            np.concatenate([points, centre[None]]),
            float(self.fractions @ np.linalg.norm(points - centre, axis=1)),
        )

    def has_limb(self, skeleton: Skeleton) -> bool:
        """Whether a limb goes through the opening."""
        return bool(self.crossings(skeleton).any())

    def crossings(self, skeleton: Skeleton) -> Int[np.ndarray, " limbs"]:
        """Returns how often each limb goes through the fan of triangles around the centre."""
        count, order = np.empty(len(skeleton.limbs), np.int64), np.arange(len(self.loop))
        fan = np.stack([order, np.roll(order, -1), np.full(len(order), len(order))], axis=1)
        crossings_of_segments(skeleton.points, skeleton.limbs, self.points, fan, count)
        return count
