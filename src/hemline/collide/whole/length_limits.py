"""Keeps the edges of a garment within their lengths, and does nothing else: no body, no memory, no coarse level."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from hemline.arrays import Vertices

from .limit_kernels import limit_fine
from .models import FineModel, fine_model

if TYPE_CHECKING:
    from hemline.garments import Garment


@dataclass(frozen=True, eq=False)
class LengthLimits:
    """Longest lengths of the edges of a garment; frozen.

    Attributes:
        model: The edges; their lengths are the longer of those on the pattern and in a settled garment.
        stretch: Longest length of an edge over that.
        sweeps: Sweeps over all edges.
    """

    model: FineModel
    stretch: float
    sweeps: int

    @classmethod
    def of(cls, garment: "Garment", settled: Vertices, *, stretch: float = 1.03, sweeps: int = 20) -> Self:
        """Prepares the limits.

        Args:
            garment: The garment.
            settled: The garment at rest on its body (verts, 3) [m].
            stretch: Longest length of an edge over the longer of those on the pattern and at rest.
            sweeps: Sweeps over all edges.
        """
        model = fine_model(garment.faces, garment.rest_edges, garment.pins.vertices)
        ends = np.asarray(settled, np.float64)[model.edges]
        at_rest = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        return cls(model._replace(lengths=np.maximum(model.lengths, at_rest).astype(np.float32)), stretch, sweeps)

    def hold(self, vertices: Vertices) -> Vertices:
        """Returns the garment with edges shortened that were too long (verts, 3) [m], float32; pins stay."""
        held = np.array(vertices, np.float32)
        limit_fine(self.model, np.float32(self.stretch), self.sweeps, held)
        return held
