"""Which places of the body hold each vertex of the cloth off, from step to step.

The closest place alone is no guide where two parts of the body meet, in the pit of a knee or under an arm, nor where
one sweeps through another: there it may be across flesh, and cloth that goes by it ends on the wrong side. So a vertex
keeps the place that it came from, which slides over the skin with it. Another place may take over in front of the
vertex, or where it leads back to the limb that the vertex lies on at rest. The place that was left so becomes the
second one and holds the vertex off too, until it is far.

Source: Baraff, Witkin, Kass, "Untangling cloth", 2003. Differs: they let pinched cloth follow the nearer part of the
body; here it is held between both.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.surface import MovingSkin, BodySurface

from .history_kernels import Places, move_places, share_stiffness

HistoryFaces = Int[np.ndarray, "verts 2"]
"""Faces of the body at the first and the second place of each vertex, -1 for none."""

MAX_DEPTH = 0.005
"""A place that a vertex lies so far behind is none that it came to by itself [m]."""

FORGET_HEIGHT = 0.015
"""A second place is forgotten from that height on [m]."""

MAX_SKEW = 2.0
"""So is one that is so many times as far away as it is high, and `MAX_DEPTH` more: it lies beside the vertex."""

YIELD_DEPTH = 0.002
"""Cloth that is pressed so far into its own limb yields to it, not to another one [m]."""


@dataclass(frozen=True)
class ContactHistory:
    """The first and the second place of each vertex.

    Attributes:
        nearest: Vertices of the body at them.
        face: Their faces, -1 for none. The first is the one that the vertex is closest to, or came from; the second
            the one that it left.
        weights: Of the corners 1 and 2.
    """

    nearest: Int[np.ndarray, "2 verts"]
    face: Int[np.ndarray, "2 verts"]
    weights: Float[np.ndarray, "2 verts 2"]

    @classmethod
    def of(cls, faces: HistoryFaces, surface: BodySurface) -> "ContactHistory":
        """From their faces."""
        face = np.ascontiguousarray(faces.T, np.int32)
        nearest = np.where(face < 0, -1, surface.faces[face, 0]).astype(np.int32)
        return cls(nearest, face, np.zeros((*face.shape, 2)))

    @property
    def faces(self) -> HistoryFaces:
        """Their faces: all that the next step needs."""
        return self.face.T.copy()

    @property
    def first(self) -> SkinPoints:
        """The first places."""
        return SkinPoints(self.nearest[0], self.face[0], self.weights[0])

    @property
    def second(self) -> SkinPoints:
        """The second places."""
        return SkinPoints(self.nearest[1], self.face[1], self.weights[1])

    def moved(
        self,
        surface: BodySurface,
        positions: Float[np.ndarray, "verts 3"],
        skin: MovingSkin,
        found: SkinPoints,
        home: Int[np.ndarray, " verts"],
    ) -> "ContactHistory":
        """The places after body and cloth have moved.

        Args:
            surface: The body's mesh.
            positions: The cloth [m].
            skin: The body.
            found: The closest places.
            home: Limb of each vertex.
        """
        nearest, face, weights = self.nearest.copy(), self.face.copy(), self.weights.copy()
        places = Places(nearest, face, weights)
        move_places(positions, surface.mesh(skin), surface.limb, home, found, MAX_DEPTH, FORGET_HEIGHT, MAX_SKEW, places)
        return ContactHistory(nearest, face, weights)

    def stiffnesses(
        self,
        surface: BodySurface,
        positions: Float[np.ndarray, "verts 3"],
        skin: MovingSkin,
        home: Int[np.ndarray, " verts"],
        pinched: Bool[np.ndarray, " verts"],
        stiffness: Float[np.ndarray, " verts"],
        yielding: float,
    ) -> Float[np.ndarray, "2 verts"]:
        """Contact stiffness of each place [N/m]. Where its own limb and another one press on a vertex, or it is
        pinched, the other one yields: what goes through a leg must not take the trousers along.

        Args:
            surface: The body's mesh.
            positions: The cloth [m].
            skin: The body.
            home: Limb of each vertex.
            pinched: Whether it has no free place.
            stiffness: Of each vertex in contact [N/m].
            yielding: Share of it that is left to what yields.
        """
        shared = np.empty((2, len(stiffness)))
        places = Places(self.nearest, self.face, self.weights)
        mesh = surface.mesh(skin)
        share_stiffness(positions, mesh, surface.limb, home, pinched, places, stiffness, yielding, YIELD_DEPTH, shared)
        return shared
