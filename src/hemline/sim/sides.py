"""Which places of the body hold each vertex of the cloth off, from step to step.

The closest place alone is no guide where two parts of the body meet, in the pit of a knee or under an arm, nor where
one sweeps through another: there it may be across flesh, and cloth that goes by it ends on the wrong side. So a vertex
keeps the place that it came from, which slides over the skin with it. Another place may take over in front of the
vertex, or where it leads back to the limb that the vertex lies on at rest. The place that was left so becomes the
second one and holds the vertex off too, until it is far.

Baraff, Witkin and Kass, "Untangling Cloth", SIGGRAPH 2003, let pinched cloth follow the nearer part of the body; here
it is held between both.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from .surface import Anchors, Skin, Surface

SideFaces = Int[np.ndarray, "verts 2"]
"""Faces of the body at the first and the second place of each vertex, -1 for none."""

DEEP = 0.005
"""A place that a vertex lies so far behind is none that it came to by itself [m]."""

FAR = 0.015
"""A second place is forgotten from that height on [m]."""

SKEW = 2.0
"""So is one that is so many times as far away as it is high, and `DEEP` more: it lies beside the vertex."""


class Sides(NamedTuple):
    """The places of each vertex.

    Attributes:
        first: The one that it is closest to, or came from; face -1: none is near.
        second: The one that it left; face -1: none.
    """

    first: Anchors
    second: Anchors

    @classmethod
    def of(cls, faces: SideFaces, surface: Surface) -> "Sides":
        """From their faces."""
        return cls(*(
            Anchors(np.where(face < 0, -1, surface.faces[face, 0]), face.copy(), np.zeros((len(face), 2)))
            for face in np.ascontiguousarray(faces.T, np.int32)
        ))  # fmt: skip

    @property
    def faces(self) -> SideFaces:
        """Their faces: all that the next step needs."""
        return np.column_stack([self.first.face, self.second.face])

    def moved(
        self, surface: Surface, positions: Float[np.ndarray, "verts 3"], skin: Skin, found: Anchors,
        home: Int[np.ndarray, " verts"],
    ) -> "Sides":  # fmt: skip
        """The places after body and cloth have moved.

        Args:
            surface: The body's mesh.
            positions: The cloth [m].
            skin: The body.
            found: The closest places.
            home: Limb of each vertex.
        """
        left, there = surface.jumped(self.first.face, found.face), self.second.face >= 0
        if not (left.any() or there.any()):
            return Sides(found, self.second)
        walked = surface.walked(positions, skin, self.first, left)
        second = surface.walked(positions, skin, self.second, there)
        left &= surface.jumped(walked.face, found.face)
        exchanged = left & there & ~surface.jumped(second.face, found.face)
        refused = np.zeros_like(left)
        new = np.flatnonzero(left & ~exchanged)
        refused[new] = _refused(surface, positions, skin, walked, found, home, new)
        first = _chosen(refused, walked, found)
        second = _chosen(left & ~refused, walked, second)
        return Sides(first, _near(surface, positions, skin, second, first))


def heights(
    surface: Surface, positions: Float[np.ndarray, "verts 3"], skin: Skin, anchors: Anchors,
    which: Int[np.ndarray, " some"],
) -> tuple[Float[np.ndarray, " some"], Float[np.ndarray, " some"], Float[np.ndarray, "some 3"]]:  # fmt: skip
    """Of some vertices the height over the skin at their place, the distance to the place [m], the normal there."""
    corners, weights = surface.faces[anchors.face[which]], anchors.weights[which]
    weights = np.column_stack([1 - weights.sum(axis=1), weights])
    normal = np.einsum("vc,vcx->vx", weights, skin.normals[corners])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    way = positions[which] - np.einsum("vc,vcx->vx", weights, skin.vertices[corners])
    return np.einsum("vx,vx->v", way, normal), np.linalg.norm(way, axis=1), normal


def _refused(
    surface: Surface, positions: np.ndarray, skin: Skin, kept: Anchors, found: Anchors, home: np.ndarray,
    which: np.ndarray,
) -> Bool[np.ndarray, " some"]:  # fmt: skip
    """Whether the closest place lies across flesh from the one that a vertex has, and not on the vertex's own limb."""
    height, _, normal = heights(surface, positions, skin, found, which)
    _, _, before = heights(surface, positions, skin, kept, which)
    opposed = np.einsum("vx,vx->v", normal, before) < 0
    own = surface.limb[found.face[which]] == home[which]
    returns = own & (surface.limb[kept.face[which]] != home[which])
    return (height < 0) & (opposed | (height < -DEEP)) & ~returns


def _near(surface: Surface, positions: np.ndarray, skin: Skin, second: Anchors, first: Anchors) -> Anchors:
    """Second places without those that are far, lie beside the vertex, or have become the first."""
    kept = surface.jumped(first.face, second.face)
    which = np.flatnonzero(kept)
    height, distance, _ = heights(surface, positions, skin, second, which)
    kept[which] = (height < FAR) & (distance < SKEW * np.abs(height) + DEEP)
    return replace(second, face=np.where(kept, second.face, -1))


def _chosen(which: Bool[np.ndarray, " verts"], first: Anchors, second: Anchors) -> Anchors:
    return Anchors(
        np.where(which, first.nearest, second.nearest), np.where(which, first.face, second.face),
        np.where(which[:, None], first.weights, second.weights),
    )  # fmt: skip
