"""How far a garment is from being at rest: the forces that are left on it."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.garments import Garment
from hemline.sim import SimSettings
from hemline.sim.rest.static_step import StaticStep
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd


class Left(NamedTuple):
    """The size of the forces on a garment, in two ways."""

    norm: float
    """Of all forces together [N]: the paper's measure. Stiff cloth that is torn in a few places decides it."""
    median: float
    """On the median vertex, over the mean weight of a vertex."""


class Residual:
    """Forces on a garment of given positions: membrane, bending, gravity, contact with body and cloth.

    Nothing has slid yet, so friction holds nothing.

    Args:
        garment: The garment.
        shaped: The body that wears it.
    """

    def __init__(self, garment: Garment, shaped: ShapedBody):
        self.dressed, self.end = DressedBody(garment, shaped, SimSettings()), FrameEnd(garment, shaped)

    def left(self, posed: PosedBody, worn: Vertices, pinched: Bool[np.ndarray, " verts"] | None = None) -> Left:
        """What is left on a garment.

        Args:
            posed: The body.
            worn: The garment, out of the body [m].
            pinched: Vertices without a free place, whose contact yields.
        """
        size = np.linalg.norm(self.forces(posed, worn, pinched), axis=1)
        return Left(float(np.linalg.norm(size)), float(np.median(size)) / self.dressed.model.mean_weight)

    def forces(
        self, posed: PosedBody, worn: Vertices, pinched: Bool[np.ndarray, " verts"] | None = None
    ) -> Float[np.ndarray, "verts 3"]:
        """Resultant force on each vertex [N]; see `left`."""
        stuck = np.zeros(len(worn), bool) if pinched is None else pinched
        workspace, scene = self.dressed.stepper.workspace, self.dressed.scene(posed)
        return StaticStep(self.dressed.model, workspace, worn.astype(np.float64), stuck, scene, None).forces

    def pushed_out(self, posed: PosedBody, worn: Vertices) -> tuple[Vertices, Bool[np.ndarray, " verts"]]:
        """The garment moved out of the body [m], and the vertices for which there is no place."""
        self.end.state = self.end.projector.start()  # no pose remembers another
        cleaned = self.end.clean(posed, worn.astype(np.float64), 1.0)
        return cleaned.positions, np.isin(np.arange(len(worn)), cleaned.pinched)
