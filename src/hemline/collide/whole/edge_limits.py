"""Keeps a garment that is blended from settled states from being stretched more than any settled state is."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Bool, Float, Int, Vertices
from hemline.meshes import rest_lengths

from .edge_limit_kernels import limit_edges

if TYPE_CHECKING:
    from hemline.garments import Garment

STRETCH = 1.15
"""Longest length of an edge, over its length by the pattern, or in the garment at rest on the body if that is longer.
In settled garments 1.1 % of the edges are longer, and 0.1 % are longer by 30 %."""
SWEEPS = 4
"""Passes over the edges that are too long."""


@dataclass(frozen=True, eq=False)
class EdgeLimits:
    """The edges of a garment, and how long each may be.

    The whole-cloth step would draw such a garment into a body that stretches it, as a large chest does. This step lets
    edges be as long as they are at rest on that body, moves nothing where no edge is too long, and keeps no state.
    """

    edges: Int[np.ndarray, "edges 2"]
    longest: Float[np.ndarray, " edges"]
    """Longest length of each edge by the pattern [m]."""
    free: Float[np.ndarray, " verts"]
    """1, or 0 for pinned vertices."""
    stretch: float = STRETCH
    """Longest length of an edge over its length at rest [1]."""

    @classmethod
    def of(
        cls, garment: "Garment", limited: Bool[np.ndarray, " verts"] | None = None, stretch: float = STRETCH
    ) -> Self:
        """Makes the limits of a garment.

        Args:
            garment: The garment.
            limited: Vertices whose edges are limited; None: all.
            stretch: Longest length of an edge over its length at rest [1].
        """
        edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
        if limited is not None:
            kept = limited[edges].all(axis=1)
            edges, lengths = edges[kept], lengths[kept]
        free = np.ones(len(garment.vertices), np.float32)
        free[garment.pins.vertices[np.isinf(garment.pins.stiffness)]] = 0
        return cls(edges, (stretch * lengths).astype(np.float32), free, stretch)

    def shorten(self, vertices: Vertices, rest: Vertices) -> Vertices:
        """Returns the garment with edges that are too long shortened (verts, 3) [m].

        Args:
            vertices: The garment now (verts, 3) [m].
            rest: The garment at rest on the body that wears it (verts, 3) [m].
        """
        moved = vertices.copy()
        limit_edges(self.edges, self.longest, self.free, rest, np.float32(self.stretch), SWEEPS, moved)
        return moved
