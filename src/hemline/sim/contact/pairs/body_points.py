"""Contact of the body's vertices with the cloth's triangles, during one step.

Contact of the cloth's vertices leaves gaps: a finger, a heel or an elbow fits between them and goes through the
triangle. Where a vertex of the body comes near the inside of a triangle, the point of the cloth there is held off from
the body as a vertex of the cloth would be, only nearer: on smooth skin the cloth's own vertices carry it.
"""

import numpy as np
from jaxtyping import Bool, Float

from hemline.sim.cloth.sheet import Sheet
from hemline.sim.contact.body.body_contact import Contact
from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.touch_kernels import BLOCK_STRIDE

from .body_point_kernels import PointContacts, PointRows, nearest_points, points_above, points_on
from .pair_kernels import PairRows

DISTANCE_RATIO = 0.2
"""Distance that triangles keep from the body's vertices, as a share of the vertices' thickness."""

POINT_MARGIN = 0.0005
"""Distance beyond that from which on they are looked for [m]."""

MAX_POINT_DEPTH = 0.005
"""How far a vertex may stand out of the cloth at the start of a step and still be found [m]."""

POINT_STIFFNESS, MAX_STIFFNESS_RATIO = 32.0, 4.0
"""How stiff a point is at one thickness: over a vertex of the cloth of the area around its vertex of the body, and at
most over those of its triangle."""

TRIANGLE_CHUNK = 256
"""Triangles worked on at a time: fixed, so that the order of what is found does not depend on the threads."""


class BodyPoints:
    """Points of the cloth above vertices of the body, in one step.

    Args:
        points: At least one.
        contact: Of the points as if they were vertices.
        distance: That they keep from the body [m].
        thickness: Distance that the cloth's vertices keep from it: how deep the load grows [m].
    """

    def __init__(self, points: PointRows, contact: Contact, distance: float, thickness: float):
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
        """Find the planes again, where the cloth is at the step's end."""
        self.contact.move(self.at(positions))

    def lay(self) -> PairRows:
        """The points as pairs with the body."""
        planes = self.contact.planes
        reach = np.einsum("px,px->p", planes.normal, planes.point) + self.distance
        return self._rows._replace(
            normal=planes.normal, reach=reach, carried=planes.carried, stiffness=planes.stiffness
        )

    def at(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "points 3"]:
        """Where the points are on the cloth."""
        out = np.empty((len(self), 3))
        points_on(positions, self.corners, self.weights, out)
        return out


class BodyPointSearch:
    """Finds the points of a sheet, step by step.

    What it keeps from step to step is how much room it needs: it changes no result.

    Args:
        sheet: The cloth.
        fixed: Vertices without contact; triangles at them have none either.
        thickness: Distance that the cloth's vertices keep from the body [m].
        friction: Coulomb's coefficient of the cloth on the body, a vertex.
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
        """The points at the guess of where the cloth will be, and which way the body holds each off; None of none.

        Args:
            contact: That of the cloth's vertices in this step.
            guess: Where the cloth is taken to go without contact [m].
        """
        if not self.thickness:
            return None
        surface, then, now = contact.surface, contact.then, contact.now
        points = self._points(contact, guess)
        kept = len(points.body_vertex)
        if not kept:
            return None
        nowhere = SkinPoints(points.body_vertex, np.full(kept, -1, np.int32), np.zeros((kept, 2)))
        free = np.zeros(kept, bool)
        meeting = Contact(surface, then, now, points.start, points.ahead, free, points.stiffness, nowhere)
        gap = np.minimum(meeting.planes.gap(points.ahead), meeting.planes.gap(meeting.planes.carried))
        near = gap < self.distance + POINT_MARGIN
        if not near.any():
            return None
        which = np.flatnonzero(near)
        held = meeting if near.all() else meeting.of(near)
        return BodyPoints(PointRows(*(each[which] for each in points)), held, self.distance, self.thickness)

    def _points(self, contact: Contact, guess: np.ndarray) -> PointRows:
        """Of each vertex of the body that the cloth is near to, the nearest point of each piece."""
        sheet, surface = self.sheet, contact.surface
        found, room = self._found(contact, guess)
        total = int(found.count.sum())
        points = PointRows(
            np.empty(total, np.int32),
            np.empty((total, 4), np.uint32),
            *(np.empty(shape) for shape in ((total, 4), (total, 3), (total, 3), total, total)),
        )
        if not total:
            return points
        kept = nearest_points(
            found,
            room,
            sheet.faces,
            sheet.piece,
            self._pieces,
            surface.mesh(contact.then),
            contact.now.vertices,
            contact.start,
            guess,
            contact.stiffness,
            self.friction,
            sheet.vertex_area,
            MAX_POINT_DEPTH,
            POINT_STIFFNESS,
            MAX_STIFFNESS_RATIO,
            points,
        )
        return PointRows(*(each[:kept] for each in points))

    def _found(self, contact: Contact, guess: np.ndarray) -> tuple[PointContacts, int]:
        """Vertices of the body that a triangle is near to, and the place in it; the room of each chunk."""
        sheet, surface, planes = self.sheet, contact.surface, contact.planes
        chunks = (len(sheet.faces) + TRIANGLE_CHUNK - 1) // TRIANGLE_CHUNK
        count = np.empty(chunks + (chunks % BLOCK_STRIDE == 0), np.int64)
        slid, far = np.empty((len(guess), 3)), np.empty((len(guess), 2))
        while True:
            room = self._room
            out, share = np.empty((len(count) * room, 2), np.int32), np.empty((len(count) * room, 3))
            found = PointContacts(count, out, share)
            points_above(
                guess,
                sheet.faces,
                self.fixed,
                contact.ahead,
                planes,
                planes.stiffness > 0,
                surface.mesh(contact.now),
                contact.now.grid(surface.reach),
                self.distance + POINT_MARGIN,
                MAX_POINT_DEPTH,
                surface.reach,
                TRIANGLE_CHUNK,
                room,
                slid,
                far,
                found,
            )
            if count.max(initial=0) <= room:
                return found, room
            self._room = int(1.5 * count.max())
