"""Memory of the places (points on the skin) that keep each cloth vertex outside the body, kept from step to step.

The closest place alone is a poor guide where two parts of the body meet, in the hollow of the knee or under an arm, or
where one part sweeps through another: it may lie on the far side of a limb, and cloth that
follows it ends up on the wrong side. So a vertex keeps the place that it came from, which slides over the skin with it.
Another place may take over if it lies in front of the vertex, or if it leads back to the limb that the vertex lies on
at rest. The old place then becomes the second one and also keeps the vertex off, until it is far away.

Source: Baraff, Witkin, Kass, "Untangling cloth", 2003. Differs: they let pinched cloth follow the nearer part of the
body; here it is held between both.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from hemline.sim.contact.body.planes import SkinPoints
from hemline.sim.contact.body.surface import BodySurface, MovingSkin

from .history_kernels import LimbLabels, Places, move_places, share_stiffness

HistoryFaces = Int[np.ndarray, "verts 2"]
"""Faces of the body at the first and the second place of each vertex, -1 for none."""


@dataclass(frozen=True)
class ContactHistory:
    """The first and the second place of each vertex.

    Attributes:
        nearest: Vertices of the body at the places.
        face: Faces of the body at the places, -1 for none. The first place is the one that the vertex is closest to or
            came from; the second place is the one that it left.
        weights: Barycentric weights of the corners 1 and 2.
    """

    nearest: Int[np.ndarray, "2 verts"]
    face: Int[np.ndarray, "2 verts"]
    weights: Float[np.ndarray, "2 verts 2"]

    @classmethod
    def from_faces(cls, faces: HistoryFaces, surface: BodySurface) -> "ContactHistory":
        """Returns a history with the given faces."""
        face = np.ascontiguousarray(faces.T, np.int32)
        nearest = np.where(face < 0, -1, surface.faces[face, 0]).astype(np.int32)
        return cls(nearest, face, np.zeros((*face.shape, 2)))

    @property
    def faces(self) -> HistoryFaces:
        """Faces at the places: all that the next step needs."""
        return self.face.T.copy()

    @property
    def first(self) -> SkinPoints:
        """The first places."""
        return SkinPoints(self.nearest[0], self.face[0], self.weights[0])

    @property
    def second(self) -> SkinPoints:
        """The second places."""
        return SkinPoints(self.nearest[1], self.face[1], self.weights[1])

    def advance(
        self,
        surface: BodySurface,
        positions: Float[np.ndarray, "verts 3"],
        skin: MovingSkin,
        closest: SkinPoints,
        rest_limb: Int[np.ndarray, " verts"],
    ) -> "ContactHistory":
        """Returns the places after body and cloth have moved.

        Args:
            surface: Topology of the body's mesh.
            positions: The cloth [m].
            skin: The skin at that moment.
            closest: The closest places.
            rest_limb: Limb that each vertex lies on at rest.
        """
        nearest, face, weights = self.nearest.copy(), self.face.copy(), self.weights.copy()
        limbs = LimbLabels(surface.limb, rest_limb)
        move_places(positions, surface.mesh(skin), limbs, closest, Places(nearest, face, weights))
        return ContactHistory(nearest, face, weights)

    def stiffnesses(
        self,
        surface: BodySurface,
        positions: Float[np.ndarray, "verts 3"],
        skin: MovingSkin,
        rest_limb: Int[np.ndarray, " verts"],
        pinched: Bool[np.ndarray, " verts"],
        stiffness: Float[np.ndarray, " verts"],
        yielding: float,
    ) -> Float[np.ndarray, "2 verts"]:
        """Returns the contact stiffness of each place [N/m].

        If a vertex is pinched, or is pressed by its own limb and by another one, contact with the other limb is
        softened: a hand that passes through a leg must not take the trousers along.

        Args:
            surface: Topology of the body's mesh.
            positions: The cloth [m].
            skin: The skin at that moment.
            rest_limb: Limb that each vertex lies on at rest.
            pinched: Vertices that cannot leave the body.
            stiffness: Contact stiffness of each vertex [N/m].
            yielding: Fraction of the stiffness that remains where contact is softened.
        """
        shared = np.empty((2, len(stiffness)))
        places = Places(self.nearest, self.face, self.weights)
        mesh, limbs = surface.mesh(skin), LimbLabels(surface.limb, rest_limb)
        share_stiffness(positions, mesh, limbs, pinched, places, stiffness, yielding, shared)
        return shared
