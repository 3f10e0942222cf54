"""A garment unrolled from its rim: every vertex has a place on the rim and a distance from it."""

from typing import TYPE_CHECKING

import numpy as np

from hemline.animators.ropes.bones.embedding import Embedding
from hemline.arrays import Float, Int
from hemline.errors import BadGarment
from hemline.meshes import geodesic_distances

from .rim import hung_from, rim_coordinates, rim_of

if TYPE_CHECKING:
    from hemline.garments.garment import Garment

Place = tuple[float, float]
"""Share of the rim, distance from it [m]."""

_HEM = 0.985
"""The last bone sits at this share of the way to the hem, safely on the cloth."""
_ACROSS = 6
"""Pieces in which the cloth between two chains is measured."""


class Chart:
    """Coordinates of a garment's vertices, and the way back from coordinates to points of the mesh."""

    def __init__(self, garment: "Garment"):
        from scipy.spatial import KDTree

        self.garment, self.rim = garment, rim_of(garment)
        self.distance = geodesic_distances(
            garment.vertices, garment.faces, hung_from(garment), rest_edges=garment.rest_edges
        )
        self.share = rim_coordinates(garment, self.rim, self.distance)
        middle = self._flat(self.share[garment.faces].astype(float), self.distance[garment.faces])
        self.usable = np.flatnonzero(np.isfinite(middle).all(1))
        self.tree = KDTree(middle[self.usable])

    def _flat(self, share: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """Middles of triangles as points of a plane, of a cylinder where the rim is closed."""
        angle = 2 * np.pi * share
        if self.rim.closed:
            radius = self.rim.length / (2 * np.pi)
            return np.column_stack([radius * np.cos(angle).mean(1), radius * np.sin(angle).mean(1), distance.mean(1)])
        return np.column_stack([self.rim.length * share.mean(1), distance.mean(1)])

    def reach(self, share: float, band: float) -> float:
        """Distance from the rim to the hem along a line of constant share, seen within a band around it [m].

        The band is wide enough for a coarse mesh: half the way between two vertices of the rim, or more.

        Raises:
            BadGarment: No cloth hangs from that part of the rim.
        """
        band = max(band, 0.51 * self.rim.widest_gap)
        near = (np.abs(self.rim.difference(self.share, share)) < band) & np.isfinite(self.distance)
        far = float(self.distance[near].max(initial=0.0))
        if far <= 0:
            what = f"garment '{self.garment.name}': cloth must hang from the whole rim"
            raise BadGarment(what, f"none at {share:.2f} of it", "ask for fewer chains, or give chains")
        return _HEM * far

    def point(self, share: float, depth: float) -> tuple[Int[np.ndarray, "3"], Float[np.ndarray, "3"]]:
        """The point of the mesh with given coordinates: corners and weights of its triangle, or of the nearest one."""
        if depth <= 0:
            return self.rim.point(share)
        where = self._flat(np.full((1, 1), share), np.full((1, 1), depth))[0]
        near = self.garment.faces[self.usable[self.tree.query(where, k=min(60, len(self.usable)))[1]]]
        u = self.rim.difference(self.share[near], share) * self.rim.length
        a, b, c = (np.stack([u[:, k], self.distance[near[:, k]] - depth], 1) for k in range(3))
        area = _cross(b - a, c - a)
        usable = np.abs(area) > 1e-12
        weights = np.stack([_cross(b, c), _cross(c, a), _cross(a, b)], 1) / np.where(usable, area, 1.0)[:, None]
        best = int(np.argmax(np.where(usable, weights.min(1), -np.inf)))
        inside = np.clip(weights[best], 0, 1)
        return near[best], inside / inside.sum()

    def embedding(self, places: list[Place]) -> Embedding:
        """The points of the mesh at many places."""
        points = [self.point(*place) for place in places]
        corners = np.array([corner for corner, _ in points], np.int32)
        return Embedding(corners, np.array([weight for _, weight in points], np.float64))

    def ways_across(self, places: list[Place], pairs: Int[np.ndarray, "pairs 2"]) -> Float[np.ndarray, " pairs"]:
        """Length of the cloth between two places, straight in these coordinates, on the unsettled mesh [m]."""
        share, depth = np.array(places).T
        part = np.linspace(0, 1, _ACROSS + 1)
        steps = self.rim.difference(share[pairs[:, 1]], share[pairs[:, 0]])
        shares = share[pairs[:, 0], None] + part * steps[:, None]
        depths = depth[pairs[:, 0], None] + part * (depth[pairs[:, 1]] - depth[pairs[:, 0]])[:, None]
        shares = shares % 1 if self.rim.closed else shares
        points = self.embedding(list(zip(shares.ravel().tolist(), depths.ravel().tolist(), strict=True)))
        line = points.embedded(self.garment.vertices).reshape(len(pairs), _ACROSS + 1, 3)
        return np.linalg.norm(np.diff(line, axis=1), axis=2).sum(1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
