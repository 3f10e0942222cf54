"""The body as contact sees it: a triangle mesh that moves within a step."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.arrays import Faces, Normals, Vertices
from hemline.sim.cloth.sheet import Rows, incidence

from .touch_kernels import closest_faces, contact_planes, fill_grid


@dataclass(frozen=True, eq=False)
class Skin:
    """The body's surface at one moment, float32."""

    vertices: Vertices
    normals: Normals

    grids: dict[float, "Grid"] = field(default_factory=dict, repr=False)

    def grid(self, cell: float) -> "Grid":
        """The vertices sorted into cells of that size [m]; kept."""
        if cell not in self.grids:
            self.grids[cell] = Grid.of(self.vertices, cell)
        return self.grids[cell]


@dataclass(frozen=True)
class Grid:
    """Points sorted into cubic cells."""

    low: Float[np.ndarray, "3"]
    cell: float
    size: Int[np.ndarray, "3"]
    starts: Int[np.ndarray, " cells_and_two"]
    order: Int[np.ndarray, " points"]

    @classmethod
    def of(cls, points: Vertices, cell: float) -> "Grid":
        """Sort points into cells."""
        low, high = (np.array([of(points[:, axis]) for axis in range(3)], np.float64) for of in (np.min, np.max))
        size = ((high - low) / cell).astype(np.int64) + 1
        starts, order = np.empty(int(size.prod()) + 2, np.int32), np.empty(len(points), np.int32)
        fill_grid(points, low, cell, size, starts, order)
        return cls(low, cell, size, starts, order)


@dataclass(frozen=True)
class Anchors:
    """Where on the surface each cloth vertex is nearest to.

    Attributes:
        nearest: Nearest body vertex within reach, -1 for none.
        face: Closest body face, -1 for none.
        weights: Barycentric weights of its corners 1 and 2.
    """

    nearest: Int[np.ndarray, " verts"]
    face: Int[np.ndarray, " verts"]
    weights: Float[np.ndarray, "verts 2"]


@dataclass(frozen=True)
class Planes:
    """Tangent planes of the body under the cloth at the end of a step.

    Attributes:
        normal: Unit normals; 0 where there is no contact.
        point: Points on the body [m].
        carried: Where the body would carry each vertex during the step [m].
        stiffness: Contact stiffness [N/m]; 0 where there is no contact.
    """

    normal: Float[np.ndarray, "verts 3"]
    point: Float[np.ndarray, "verts 3"]
    carried: Float[np.ndarray, "verts 3"]
    stiffness: Float[np.ndarray, " verts"]

    def gap(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, " verts"]:
        """Signed distance from the planes [m], infinite where there is none."""
        distance = np.einsum("vi,vi->v", self.normal, positions - self.point)
        return np.where(self.stiffness > 0, distance, np.inf)


class Surface:
    """Topology of the body's mesh, and the searches on it.

    Args:
        faces: Triangles of the body.
        reach: How far from the body's vertices contact is looked for [m].
        limb: Limb of each triangle; None: there is but one.
    """

    def __init__(self, faces: Faces, *, reach: float, limb: Int[np.ndarray, " faces"] | None = None):
        self.faces = np.ascontiguousarray(faces, np.int32)
        self.limb = np.zeros(len(faces), np.int64) if limb is None else limb
        self.reach = reach
        self.star: Rows = incidence(self.faces.ravel(), np.arange(self.faces.size) // 3, int(faces.max()) + 1)

    def anchors(
        self,
        positions: Float[np.ndarray, "verts 3"],
        skin: Skin,
        fixed: Bool[np.ndarray, " verts"],
        known: Anchors | None = None,
        *,
        reach: float | None = None,
        asked: Bool[np.ndarray, " verts"] | None = None,
    ) -> Anchors:
        """The closest point on the surface for every cloth vertex that is not fixed, or only for some.

        Args:
            positions: The cloth [m].
            skin: The surface.
            fixed: Vertices that need none.
            known: Earlier anchors; they speed the search and do not change its result.
            reach: How far to look [m]; None: as far as usual.
            asked: Vertices that are looked for; the others keep their earlier anchors. None: all that are not fixed.
        """
        count = len(positions)
        grid = skin.grid(self.reach)
        nearest = np.full(count, -1, np.int32) if known is None else known.nearest.copy()
        if known is None or asked is None:
            face, weights, asked = np.full(count, -1, np.int32), np.zeros((count, 2)), ~fixed
        else:
            face, weights = known.face.copy(), known.weights.copy()
        closest_faces(
            positions,
            skin.vertices,
            self.faces,
            self.star.starts,
            self.star.columns,
            grid.low,
            grid.cell,
            grid.size,
            grid.starts,
            grid.order,
            reach or self.reach,
            asked,
            nearest,
            face,
            weights,
        )
        return Anchors(nearest, face, weights)

    def planes(
        self,
        anchors: Anchors,
        start: Float[np.ndarray, "verts 3"],
        then: Skin,
        now: Skin,
        push: Float[np.ndarray, " verts"],
    ) -> Planes:
        """Contact planes at the end of a step, from anchors found at its start or at its end.

        Args:
            anchors: Closest points.
            start: The cloth at the step's start [m].
            then: The surface at the step's start.
            now: The surface at its end.
            push: Stiffness of each vertex in contact [N/m].
        """
        count = len(start)
        normal, point, carried, stiffness = (np.empty(shape) for shape in ((count, 3), (count, 3), (count, 3), count))
        contact_planes(
            start,
            anchors.face,
            anchors.weights,
            self.faces,
            then.vertices,
            now.vertices,
            now.normals,
            push,
            normal,
            point,
            carried,
            stiffness,
        )
        return Planes(normal, point, carried, stiffness)


def no_planes(count: int) -> Planes:
    """No contact at all."""
    nothing = np.zeros((count, 3))
    return Planes(nothing, nothing, nothing, np.zeros(count))
