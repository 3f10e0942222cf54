"""The body's surface for contact: a triangle mesh that moves within a step."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.arrays import Faces, Normals, Vertices
from hemline.sim.cloth.rows import Rows, incidence

from .planes import Planes, SkinPoints
from .touch_kernels import SearchGrid, SkinMesh, closest_faces, contact_planes, fill_grid


@dataclass(frozen=True, eq=False)
class MovingSkin:
    """Vertices and normals of the moving skin at one moment, float32."""

    vertices: Vertices
    normals: Normals

    grids: dict[float, SearchGrid] = field(default_factory=dict, repr=False)

    def grid(self, cell: float) -> SearchGrid:
        """Returns a search grid with cells of the given size [m]; grids are cached."""
        if cell not in self.grids:
            self.grids[cell] = make_grid(self.vertices, cell)
        return self.grids[cell]


def make_grid(points: Vertices, cell: float) -> SearchGrid:
    """Sorts points into a search grid with cells of the given size [m]."""
    low, high = (np.array([of(points[:, axis]) for axis in range(3)], np.float64) for of in (np.min, np.max))
    size = ((high - low) / cell).astype(np.int64) + 1
    starts, order = np.empty(int(size.prod()) + 2, np.int32), np.empty(len(points), np.int32)
    fill_grid(points, low, cell, size, starts, order)
    return SearchGrid(low, cell, size, starts, order)


class BodySurface:
    """Topology of the body's mesh, and searches on it.

    Args:
        faces: Triangles of the body.
        reach: Distance from the body's vertices within which contact is searched for [m].
        limb: Limb of each triangle; None for a body with a single limb.
    """

    def __init__(self, faces: Faces, *, reach: float, limb: Int[np.ndarray, " faces"] | None = None):
        self.faces = np.ascontiguousarray(faces, np.int32)
        self.limb = np.zeros(len(faces), np.int64) if limb is None else limb
        self.reach = reach
        self.star: Rows = incidence(self.faces.ravel(), np.arange(self.faces.size) // 3, int(faces.max()) + 1)

    def mesh(self, skin: MovingSkin) -> SkinMesh:
        """Returns the mesh at one moment, as kernels take it."""
        return SkinMesh(skin.vertices, skin.normals, self.faces, *self.star)

    def closest(
        self,
        positions: Float[np.ndarray, "verts 3"],
        skin: MovingSkin,
        fixed: Bool[np.ndarray, " verts"],
        known: SkinPoints | None = None,
        *,
        reach: float | None = None,
        selected: Bool[np.ndarray, " verts"] | None = None,
    ) -> SkinPoints:
        """Returns the closest point on the skin for every cloth vertex that is not fixed, or for selected ones.

        Args:
            positions: The cloth [m].
            skin: The skin at that moment.
            fixed: Vertices that need no closest point.
            known: Earlier closest points; they speed the search and do not change its result.
            reach: Search distance [m]; None for that of the surface.
            selected: Vertices to search for; the others keep their earlier points. None for all that are not fixed.
        """
        count = len(positions)
        grid = skin.grid(self.reach)
        nearest = np.full(count, -1, np.int32) if known is None else known.nearest.copy()
        if known is None or selected is None:
            face, weights, selected = np.full(count, -1, np.int32), np.zeros((count, 2)), ~fixed
        else:
            face, weights = known.face.copy(), known.weights.copy()
        closest = SkinPoints(nearest, face, weights)
        closest_faces(positions, self.mesh(skin), tuple(grid), reach or self.reach, selected, closest)
        return closest

    def planes(
        self,
        closest: SkinPoints,
        start: Float[np.ndarray, "verts 3"],
        then: MovingSkin,
        now: MovingSkin,
        stiffness: Float[np.ndarray, " verts"],
    ) -> Planes:
        """Returns contact planes at the end of a step, for places at its start or at its end.

        Args:
            closest: The places.
            start: The cloth at the start of the step [m].
            then: The skin at the start of the step.
            now: The skin at the end of the step.
            stiffness: Contact stiffness of each vertex [N/m].
        """
        count = len(start)
        planes = Planes(*(np.empty(shape) for shape in ((count, 3), (count, 3), (count, 3), count)))
        contact_planes(start, tuple(closest), then.vertices, tuple(self.mesh(now)), stiffness, planes)
        return planes
