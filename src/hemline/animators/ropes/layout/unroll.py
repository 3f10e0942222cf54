"""Unrolling of a garment from its rim: each vertex gets a place on the rim and a distance from it."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.animators.ropes.bones.embedding import NodeEmbedding
from hemline.arrays import Float, Int
from hemline.errors import BadGarment
from hemline.meshes import geodesic_distances

from .rim import rim_coordinates, rim_of, suspension_vertices

if TYPE_CHECKING:
    from hemline.garments.garment import Garment

Place = tuple[float, float]
"""Fraction of the rim, and distance from the rim [m]."""

_HEM_FRACTION = 0.985
"""The last bone lies at this fraction of the distance to the hem, safely on the cloth."""
_PIECES_ACROSS = 6
"""Number of pieces into which a line between two chains is divided to measure its length."""


class UnrolledGarment:
    """Coordinates of a garment's vertices, and the inverse map from coordinates to points of the mesh."""

    def __init__(self, garment: "Garment"):
        from scipy.spatial import KDTree

        self.garment, self.rim = garment, rim_of(garment)
        self.distance = geodesic_distances(
            garment.vertices, garment.faces, suspension_vertices(garment), rest_edges=garment.rest_edges
        )
        self.fraction = rim_coordinates(garment, self.rim, self.distance)
        middle = self._flat(self.fraction[garment.faces].astype(float), self.distance[garment.faces])
        self.usable = np.flatnonzero(np.isfinite(middle).all(1))
        self.tree = KDTree(middle[self.usable])

    def _flat(self, fraction: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Returns the centres of triangles as points of a plane, or of a cylinder where the rim is closed."""
        angle = 2 * np.pi * fraction
        if self.rim.closed:
            radius = self.rim.length / (2 * np.pi)
            return np.column_stack([radius * np.cos(angle).mean(1), radius * np.sin(angle).mean(1), distance.mean(1)])
        return np.column_stack([self.rim.length * fraction.mean(1), distance.mean(1)])

    def reach(self, fraction: float, band: float) -> float:
        """Returns the distance from the rim to the hem along a line of constant fraction, within a band around it [m].

        The band is wide enough for a coarse mesh: at least half the distance between two vertices of the rim.

        Raises:
            BadGarment: No cloth hangs from that part of the rim.
        """
        band = max(band, 0.51 * self.rim.widest_gap)
        near = (np.abs(self.rim.difference(self.fraction, fraction)) < band) & np.isfinite(self.distance)
        far = float(self.distance[near].max(initial=0.0))
        if far <= 0:
            what = f"garment '{self.garment.name}': cloth must hang from the whole rim"
            raise BadGarment(what, f"none at {fraction:.2f} of it", "ask for fewer chains, or give chains")
        return _HEM_FRACTION * far

    def point(self, fraction: float, depth: float) -> tuple[Int[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """Returns the point with given coordinates: corners and weights of its triangle, or of the nearest one."""
        if depth <= 0:
            return self.rim.point(fraction)
        where = self._flat(np.full((1, 1), fraction), np.full((1, 1), depth))[0]
        near = self.garment.faces[self.usable[self.tree.query(where, k=min(60, len(self.usable)))[1]]]
        u = self.rim.difference(self.fraction[near], fraction) * self.rim.length
        a, b, c = (np.stack([u[:, k], self.distance[near[:, k]] - depth], 1) for k in range(3))
        area = _cross(b - a, c - a)
        usable = np.abs(area) > 1e-12
        weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], 1) / np.where(usable, area, 1.0)[:, None]
        best = int(np.argmax(np.where(usable, weights.min(1), -np.inf)))
        inside = np.clip(weights[best], 0, 1)
        return near[best], inside / inside.sum()

    def embedding(self, places: list[Place]) -> NodeEmbedding:
        """Returns the points of the mesh at many places."""
        points = [self.point(*place) for place in places]
        corners = np.array([corner for corner, _ in points], np.int32)
        return NodeEmbedding(corners, np.array([weight for _, weight in points], np.float64))

    def lengths_across(self, places: list[Place], pairs: Int[np.ndarray, "pairs 2"]) -> Float[np.ndarray, " pairs"]:
        """Returns the length of cloth between the two places of each pair, on the mesh before it settles [m].

        It is measured along the line that is straight in rim fraction and distance from the rim.
        """
        fraction, depth = np.array(places).T
        part = np.linspace(0, 1, _PIECES_ACROSS + 1)
        steps = self.rim.difference(fraction[pairs[:, 1]], fraction[pairs[:, 0]])
        fractions = fraction[pairs[:, 0], None] + part * steps[:, None]
        depths = depth[pairs[:, 0], None] + part * (depth[pairs[:, 1]] - depth[pairs[:, 0]])[:, None]
        fractions = fractions % 1 if self.rim.closed else fractions
        points = self.embedding(list(zip(fractions.ravel().tolist(), depths.ravel().tolist(), strict=True)))
        line = points.positions_on(self.garment.vertices).reshape(len(pairs), _PIECES_ACROSS + 1, 3)
        return np.linalg.norm(np.diff(line, axis=1), axis=2).sum(1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
