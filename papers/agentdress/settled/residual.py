"""The residual of a garment: the forces on it, which are 0 when it is at rest."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.garments import Garment
from hemline.sim import SimSettings
from hemline.sim.rest.static_step import StaticStep
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd


class ResidualSize(NamedTuple):
    """Two measures of the forces on a garment."""

    norm: float
    """Norm of all forces [N], as in the paper. A few places of strongly stretched stiff cloth dominate it."""
    median: float
    """Force on the median vertex, relative to the mean weight of a vertex."""


class Residual:
    """Forces on a garment in given positions: membrane, bending, gravity, contact with body and cloth.

    Friction is 0, as nothing has slid yet.

    Args:
        garment: The garment.
        shaped: The body that wears it.
    """

    def __init__(self, garment: Garment, shaped: ShapedBody):
        self.dressed, self.end = DressedBody(garment, shaped, SimSettings()), FrameEnd(garment, shaped)

    def measure(
        self, posed: PosedBody, vertices: Vertices, pinched: Bool[np.ndarray, " verts"] | None = None
    ) -> ResidualSize:
        """Measures the residual of a garment.

        Args:
            posed: The body.
            vertices: The garment, outside the body [m].
            pinched: Pinched vertices, whose contact yields.
        """
        size = np.linalg.norm(self.forces(posed, vertices, pinched), axis=1)
        return ResidualSize(float(np.linalg.norm(size)), float(np.median(size)) / self.dressed.model.mean_weight)

    def forces(
        self, posed: PosedBody, vertices: Vertices, pinched: Bool[np.ndarray, " verts"] | None = None
    ) -> Float[np.ndarray, "verts 3"]:
        """Returns the resultant force on each vertex [N]; see `measure`."""
        stuck = np.zeros(len(vertices), bool) if pinched is None else pinched
        workspace, scene = self.dressed.stepper.workspace, self.dressed.scene(posed)
        return StaticStep(self.dressed.model, workspace, vertices.astype(np.float64), stuck, scene, None).forces

    def push_out(self, posed: PosedBody, vertices: Vertices) -> tuple[Vertices, Bool[np.ndarray, " verts"]]:
        """Moves a garment out of the body; returns its vertices [m] and a mask of the pinched ones."""
        cleaned = self.end.clean(posed, vertices.astype(np.float64), 1.0)  # independent of earlier poses
        return cleaned.positions, np.isin(np.arange(len(vertices)), cleaned.pinched)
