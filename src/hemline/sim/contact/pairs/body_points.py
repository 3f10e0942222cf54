"""Contact of the body's vertices with the cloth's triangles, during one step.

Contact of the cloth's vertices alone leaves gaps: a finger, a heel or an elbow fits between them and goes through the
triangle. Where a vertex of the body comes near the inside of a triangle, the body holds off the point of the cloth
there like a vertex of the cloth, but at a smaller distance: on smooth skin the cloth's own vertices carry it.
"""

import numpy as np
from jaxtyping import Bool, Float

from hemline.sim.cloth.sheet import Sheet
from hemline.sim.contact.body.body_contact import ClosestContact, Contact
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.touch_kernels import BLOCK_STRIDE

from .body_point_kernels import (
    TRIANGLE_CHUNK,
    GuessedCloth,
    PointContacts,
    PointRows,
    SlidCloth,
    nearest_points,
    points_above,
    points_on,
)
from .pair_kernels import PairRows

DISTANCE_RATIO = 0.2
"""Distance between triangles and vertices of the body, as a fraction of the thickness for cloth vertices."""

POINT_MARGIN = 0.0005
"""Additional distance within which triangles are searched for [m]."""


class BodyPoints:
    """Points of the cloth above vertices of the body, in one step.

    Args:
        points: The points, at least one.
        contact: Contact of the points, as if they were vertices.
        distance: Distance that the points keep from the body [m].
        thickness: Depth over which the load grows: the distance that the cloth's vertices keep from the body [m].
    """

    def __init__(self, points: PointRows, contact: ClosestContact, distance: float, thickness: float):
        self.contact, self.distance = contact, distance
        self.body_vertex, self.corners, self.weights = points.body_vertex, points.corners, points.weights
        planes = contact.planes
        depth = np.clip(distance - planes.gap(planes.carried), 0, thickness)
        self._rows = PairRows(
            corners=self.corners,
            weights=self.weights,
            normal=planes.normal,
            reach=depth,
            carried=planes.carried,
            thickness=np.full(len(self), thickness),
            stiffness=planes.stiffness,
            limit=points.friction * planes.stiffness * depth**2 / thickness,
        )

    def __len__(self) -> int:
        return len(self.corners)

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> None:
        """Updates the planes to the cloth at the end of the step."""
        self.contact.move(self.at(positions))

    def pair_rows(self) -> PairRows:
        """Returns the points as pairs with the body."""
        planes = self.contact.planes
        reach = np.einsum("px,px->p", planes.normal, planes.point) + self.distance
        return self._rows._replace(
            normal=planes.normal, reach=reach, carried=planes.carried, stiffness=planes.stiffness
        )

    def at(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "points 3"]:
        """Returns the points on the cloth [m]."""
        out = np.empty((len(self), 3))
        points_on(positions, self.corners, self.weights, out)
        return out


class BodyPointSearch:
    """Finds the points of a sheet, step by step.

    It keeps nothing from step to step but the size of its arrays, which changes no result.

    Args:
        sheet: The cloth.
        fixed: Vertices without contact; their triangles have none either.
        thickness: Distance that the cloth's vertices keep from the body [m].
        friction: Coulomb's coefficient of each vertex on the body.
    """

    def __init__(
        self,
        sheet: Sheet,
        *,
        fixed: Bool[np.ndarray, " verts"],
        thickness: float,
        friction: Float[np.ndarray, " verts"],
    ):
        self.sheet, self.fixed, self.friction = sheet, fixed, friction
        self.thickness, self.distance = thickness, DISTANCE_RATIO * thickness
        self._room = 16
        self._pieces = int(sheet.piece.max(initial=0)) + 1

    def find(self, contact: Contact, guess: Float[np.ndarray, "verts 3"]) -> BodyPoints | None:
        """Returns the points near the body, with the planes that hold them off; None if there are none.

        Args:
            contact: Contact of the cloth's vertices in this step.
            guess: Predicted cloth at the end of the step, without contact [m].
        """
        if not self.thickness:
            return None
        surface, then, now = contact.surface, contact.then, contact.now
        points = self._points(contact, guess)
        count = len(points.body_vertex)
        if not count:
            return None
        known = SkinPoints(points.body_vertex, np.full(count, -1, np.int32), np.zeros((count, 2)))
        fixed = np.zeros(count, bool)
        touching = ClosestContact(surface, then, now, points.start, points.ahead, fixed, points.stiffness, known)
        gap = np.minimum(touching.planes.gap(points.ahead), touching.planes.gap(touching.planes.carried))
        near = gap < self.distance + POINT_MARGIN
        if not near.any():
            return None
        which = np.flatnonzero(near)
        touching = touching if near.all() else touching.subset(near)
        return BodyPoints(PointRows(*(each[which] for each in points)), touching, self.distance, self.thickness)

    def _points(self, contact: Contact, guess: np.ndarray) -> PointRows:
        """Returns the nearest point of each piece of cloth for each nearby vertex of the body."""
        sheet = self.sheet
        cloth = GuessedCloth(
            guess,
            contact.start,
            sheet.faces,
            self.fixed,
            sheet.piece,
            contact.stiffness,
            self.friction,
            sheet.vertex_area,
        )
        candidates = self._search(contact, cloth)
        total = int(candidates.count.sum())
        points = PointRows(
            np.empty(total, np.int32),
            np.empty((total, 4), np.uint32),
            *(np.empty(shape) for shape in ((total, 4), (total, 3), (total, 3), total, total)),
        )
        if not total:
            return points
        then = contact.surface.mesh(contact.then)
        count = nearest_points(candidates, cloth, self._pieces, then, contact.now.vertices, points)
        return PointRows(*(each[:count] for each in points))

    def _search(self, contact: Contact, cloth: GuessedCloth) -> PointContacts:
        """Returns pairs of a body vertex and a nearby triangle."""
        surface, chunks = contact.surface, (len(cloth.faces) + TRIANGLE_CHUNK - 1) // TRIANGLE_CHUNK
        skin, grid = surface.mesh(contact.now), contact.now.grid(surface.reach)
        count = np.empty(chunks + (chunks % BLOCK_STRIDE == 0), np.int64)
        slid = SlidCloth(np.empty((len(cloth.guess), 3)), np.empty((len(cloth.guess), 2)))
        slack = self.distance + POINT_MARGIN
        while True:
            room = self._room
            entries, weights = np.empty((len(count) * room, 2), np.int32), np.empty((len(count) * room, 3))
            candidates = PointContacts(count, entries, weights)
            points_above(cloth, contact.ahead, contact.planes, skin, grid, slack, slid, candidates)
            if count.max(initial=0) <= room:
                return candidates
            self._room = int(1.5 * count.max())
