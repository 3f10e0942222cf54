"""Contact of the body's vertices with the cloth's triangles, during one step.

Contact of the cloth's vertices leaves gaps: a finger, a heel or an elbow fits between them and goes through the
triangle. Where a vertex of the body comes near the inside of a triangle, the point of the cloth there is held off from
the body as a vertex of the cloth would be, only nearer: on smooth skin the cloth's own vertices carry it.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from .body_point_kernels import areas_around, points_above
from .contact import Contact
from .pairs import PairRows
from .sheet import Sheet
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


_NOTHING = np.empty(0, np.int32), np.empty(0, np.int32), np.empty((0, 2))


class BodyPoints:
    """Points of the cloth above vertices of the body, step by step.

    Args:
        sheet: The cloth.
        fixed: Vertices without contact; triangles at them have none either.
        thickness: Distance that the cloth's vertices keep from the body [m].
        friction: Coulomb's coefficient of the cloth on the body, a vertex.

    Attributes:
        body_vertex: Vertex of the body under each point.
        corners: Triangle of each point.
        weights: Of its corners.
        contact: Of the points as if they were vertices; None before the first.
    """

    def __init__(
        self, sheet: Sheet, *, fixed: Bool[np.ndarray, " verts"], thickness: float,
        friction: Float[np.ndarray, " verts"],
    ):  # fmt: skip
        self.sheet, self.fixed, self.friction = sheet, fixed, friction
        self.thickness, self.distance = thickness, SHARE * thickness
        self._room = 16
        self.contact: Contact | None = None
        self.body_vertex = np.empty(0, np.int32)
        self.corners, self.weights = np.empty((0, 3), np.uint32), np.empty((0, 3))
        self._rows: PairRows | None = None

    def __len__(self) -> int:
        return len(self.corners)

    def begin(self, contact: Contact, guess: Float[np.ndarray, "verts 3"]) -> None:
        """Find the points at the guess of where the cloth will be, and which way the body holds each off.

        Args:
            contact: That of the cloth's vertices in this step.
            guess: Where the cloth is taken to go without contact [m].
        """
        body_vertex, face, share = self._found(contact, guess)
        self.corners = self.sheet.faces[face]
        self.weights = np.column_stack([1 - share.sum(axis=1), share])
        if not len(face):
            return
        then, start, ahead = contact.then, self.at(contact.start), self.at(guess)
        # a vertex of the far side of a finger is behind the cloth that lies on this side
        height = np.einsum("px,px->p", then.normals[body_vertex], start - then.vertices[body_vertex])
        known = Anchors(body_vertex, np.full(len(face), -1, np.int32), np.zeros((len(face), 2)))
        free = np.zeros(len(face), bool)
        points = Contact(contact.surface, then, contact.now, start, ahead, free, self.at(contact.push), known)
        gap = np.minimum(points.planes.gap(ahead), points.planes.gap(points.planes.carried))
        near = (height > -DEEPEST) & (gap < self.distance + MARGIN)
        self.body_vertex, self.corners, self.weights = body_vertex[near], self.corners[near], self.weights[near]
        if not len(self):
            return
        self.contact = points.of(near, self._stiffer(contact))
        planes, count = self.contact.planes, len(self)
        depth = np.clip(self.distance - planes.gap(planes.carried), 0, self.thickness)
        self._rows = PairRows(
            corners=np.column_stack([self.corners, self.corners[:, 2]]),
            weights=np.column_stack([self.weights, np.zeros(count)]), normal=planes.normal, reach=depth,
            carried=planes.carried, thickness=np.full(count, self.thickness), stiffness=planes.stiffness,
            limit=self.at(self.friction) * planes.stiffness * depth**2 / self.thickness,
        )  # fmt: skip

    def _stiffer(self, contact: Contact) -> Float[np.ndarray, " points"]:
        """Stiffness of the points over that of the cloth's vertices around."""
        surface, area = contact.surface, np.empty(len(self))
        star = surface.star
        areas_around(self.body_vertex, contact.now.vertices, surface.faces, star.starts, star.columns, area)
        return np.minimum(STIFFNESS * area / self.at(self.sheet.vertex_area), STIFFEST)

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

    def at(self, values: np.ndarray) -> np.ndarray:
        """Values of vertices, at the points."""
        return np.einsum("pc,pc...->p...", self.weights, values[self.corners])

    def _found(self, contact: Contact, guess: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices of the body that a triangle is near to, the nearest such one of each piece, and the place in it."""
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
                guess, sheet.faces, self.fixed, ahead.face, ahead.weights, planes.carried, planes.normal,
                planes.stiffness > 0,
                contact.now.vertices, contact.now.normals, surface.faces, grid.low, grid.cell, grid.size, grid.starts,
                grid.order, self.distance + MARGIN, DEEPEST, surface.reach, CHUNK, room, slid, far, count, out, share,
            )  # fmt: skip
            if count.max(initial=0) <= room:
                break
            self._room = int(1.5 * count.max())
        total = int(count.sum())
        if not total:
            return _NOTHING
        kept = np.repeat(room * np.arange(len(count)) - np.cumsum(count) + count, count) + np.arange(total)
        (vertex, face), share = out[kept].T, share[kept]
        # the nearest triangle of each piece: one worn over another meets the same finger
        kind = vertex.astype(np.int64) * (int(sheet.piece.max()) + 1) + sheet.piece[sheet.faces[face, 0]]
        order = np.lexsort((face, share[:, 2], kind))
        first = order[np.unique(kind[order], return_index=True)[1]]
        return vertex[first], face[first], share[first, :2]
