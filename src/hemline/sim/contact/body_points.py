"""Contact of the body's vertices with the cloth's triangles, during one step.

Contact of the cloth's vertices leaves gaps: a finger, a heel or an elbow fits between them and goes through the
triangle. Where a vertex of the body comes near the inside of a triangle, the point of the cloth there is held off from
the body as a vertex of the cloth would be, only nearer: on smooth skin the cloth's own vertices carry it.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from hemline.sim.cloth.sheet import Sheet

from .body_contact import Contact
from .body_point_kernels import nearest_points, points_above, points_on
from .pairs import PairRows
from .surface import Anchors
from .touch_kernels import STRIDE

SHARE = 0.2
"""Distance that triangles keep from the body's vertices, as a share of the vertices' thickness."""

MARGIN = 0.0005
"""Distance beyond that from which on they are looked for [m]."""

DEEPEST = 0.005
"""How far a vertex may stand out of the cloth at the start of a step and still be found [m]."""

STIFFNESS, STIFFEST = 32.0, 4.0
"""How stiff a point is at one thickness: over a vertex of the cloth of the area around its vertex of the body, and at
most over those of its triangle."""

CHUNK = 256
"""Triangles worked on at a time: fixed, so that the order of what is found does not depend on the threads."""


class _Found(NamedTuple):
    """What the search returns: chunk by chunk so many entries, each chunk with the same room."""

    count: np.ndarray
    room: int
    entries: np.ndarray
    share: np.ndarray


_NOTHING = _Found(np.zeros(0, np.int64), 0, np.empty((0, 2), np.int32), np.empty((0, 3)))


class BodyPoints:
    """Points of the cloth above vertices of the body, step by step.

    Args:
        sheet: The cloth.
        fixed: Vertices without contact; triangles at them have none either.
        thickness: Distance that the cloth's vertices keep from the body [m].
        friction: Coulomb's coefficient of the cloth on the body, a vertex.

    Attributes:
        body_vertex: Vertex of the body under each point.
        corners: Triangle of each point; its last corner stands twice.
        weights: Of its corners, the last of them 0.
        contact: Of the points as if they were vertices; None before the first.
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
        self.thickness, self.distance = thickness, SHARE * thickness
        self._room = 16
        self.contact: Contact | None = None
        self.body_vertex = np.empty(0, np.int32)
        self.corners, self.weights = np.empty((0, 4), np.uint32), np.empty((0, 4))
        self._pieces = int(sheet.piece.max(initial=0)) + 1
        self._rows: PairRows | None = None

    def __len__(self) -> int:
        return len(self.corners)

    def begin(self, contact: Contact, guess: Float[np.ndarray, "verts 3"]) -> None:
        """Find the points at the guess of where the cloth will be, and which way the body holds each off.

        Args:
            contact: That of the cloth's vertices in this step.
            guess: Where the cloth is taken to go without contact [m].
        """
        sheet, surface, then, now = self.sheet, contact.surface, contact.then, contact.now
        found = self._found(contact, guess)
        total = int(found.count.sum())
        body_vertex, corners = np.empty(total, np.int32), np.empty((total, 4), np.uint32)
        weights, start, ahead = np.empty((total, 4)), np.empty((total, 3)), np.empty((total, 3))
        push, friction = np.empty(total), np.empty(total)
        kept = (
            0
            if not total
            else nearest_points(
                *found,
                sheet.faces,
                sheet.piece,
                self._pieces,
                then.vertices,
                then.normals,
                now.vertices,
                surface.faces,
                surface.star.starts,
                surface.star.columns,
                contact.start,
                guess,
                contact.push,
                self.friction,
                sheet.vertex_area,
                DEEPEST,
                STIFFNESS,
                STIFFEST,
                body_vertex,
                corners,
                weights,
                start,
                ahead,
                push,
                friction,
            )
        )
        nowhere = Anchors(body_vertex[:kept], np.full(kept, -1, np.int32), np.zeros((kept, 2)))
        free, ahead = np.zeros(kept, bool), ahead[:kept]
        near = free
        if kept:
            points = Contact(surface, then, now, start[:kept], ahead, free, push[:kept], nowhere)
            gap = np.minimum(points.planes.gap(ahead), points.planes.gap(points.planes.carried))
            near = gap < self.distance + MARGIN
            self.contact = points if near.all() else points.of(near)
        which = np.flatnonzero(near)
        self.body_vertex, self.corners, self.weights = body_vertex[which], corners[which], weights[which]
        if not len(self):
            return
        assert self.contact is not None
        planes = self.contact.planes
        depth = np.clip(self.distance - planes.gap(planes.carried), 0, self.thickness)
        self._rows = PairRows(
            corners=self.corners,
            weights=self.weights,
            normal=planes.normal,
            reach=depth,
            carried=planes.carried,
            thickness=np.full(len(self), self.thickness),
            stiffness=planes.stiffness,
            limit=friction[which] * planes.stiffness * depth**2 / self.thickness,
        )

    def move(self, positions: Float[np.ndarray, "verts 3"]) -> None:
        """Find the planes again, where the cloth is at the step's end."""
        if len(self):
            assert self.contact is not None
            self.contact.move(self.at(positions))

    def lay(self) -> PairRows:
        """The points as pairs with the body."""
        assert self.contact is not None and self._rows is not None
        planes = self.contact.planes
        reach = np.einsum("px,px->p", planes.normal, planes.point) + self.distance
        return replace(
            self._rows, normal=planes.normal, reach=reach, carried=planes.carried, stiffness=planes.stiffness
        )

    def at(self, positions: Float[np.ndarray, "verts 3"]) -> Float[np.ndarray, "points 3"]:
        """Where the points are on the cloth."""
        out = np.empty((len(self), 3))
        points_on(positions, self.corners, self.weights, out)
        return out

    def _found(self, contact: Contact, guess: np.ndarray) -> "_Found":
        """Vertices of the body that a triangle is near to, and the place in it."""
        sheet, surface, ahead, planes = self.sheet, contact.surface, contact.ahead, contact.planes
        if not self.thickness:
            return _NOTHING
        grid = contact.now.grid(surface.reach)
        chunks = (len(sheet.faces) + CHUNK - 1) // CHUNK
        count = np.empty(chunks + (chunks % STRIDE == 0), np.int64)
        slid, far = np.empty((len(guess), 3)), np.empty((len(guess), 2))
        while True:
            room = self._room
            out, share = np.empty((len(count) * room, 2), np.int32), np.empty((len(count) * room, 3))
            points_above(
                guess,
                sheet.faces,
                self.fixed,
                ahead.face,
                ahead.weights,
                planes.carried,
                planes.normal,
                planes.stiffness > 0,
                contact.now.vertices,
                contact.now.normals,
                surface.faces,
                grid.low,
                grid.cell,
                grid.size,
                grid.starts,
                grid.order,
                self.distance + MARGIN,
                DEEPEST,
                surface.reach,
                CHUNK,
                room,
                slid,
                far,
                count,
                out,
                share,
            )
            if count.max(initial=0) <= room:
                return _Found(count, room, out, share)
            self._room = int(1.5 * count.max())
