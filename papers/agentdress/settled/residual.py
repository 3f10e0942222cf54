"""The residual of a garment: the forces on it after a little relaxation, which are small near a garment at rest."""

from typing import NamedTuple

import numpy as np

from hemline.arrays import Bool, Float, Vertices
from hemline.bodies.body import PosedBody, ShapedBody
from hemline.garments import Garment
from hemline.sim import SimSettings
from hemline.sim.rest.statics import EquilibriumSearch
from hemline.sim.step.dressed_body import DressedBody
from hemline.sim.step.frame_end import FrameEnd

RELAXING_STEPS = 2
"""Number of Newton steps towards equilibrium before the forces are measured.

Cloth is so stiff against stretch that displacements of 0.1 mm without any pattern, far below what is seen, cause 85
weights on the median vertex, nearly as much as a model that is a centimetre off. Two steps take such noise away, and
leave what is wrong over several edges.
"""


class ResidualSize(NamedTuple):
    """Two measures of the forces on a garment."""

    norm: float
    """Norm of all forces [N], as in the paper. A few places of strongly stretched stiff cloth dominate it."""
    median: float
    """Force on the median vertex, relative to the mean weight of a vertex."""


class Residual:
    """Forces on a garment in given positions: membrane, bending, gravity, contact with body and cloth.

    Friction is 0 at first, as nothing has slid yet, so a settled garment has a residual after relaxation, too.

    Args:
        garment: The garment.
        shaped: The body that wears it.
    """

    def __init__(self, garment: Garment, shaped: ShapedBody):
        self.dressed, self.end = DressedBody(garment, shaped, SimSettings()), FrameEnd(garment, shaped)

    def measure(
        self,
        posed: PosedBody,
        vertices: Vertices,
        pinched: Bool[np.ndarray, " verts"] | None = None,
        steps: int = RELAXING_STEPS,
    ) -> ResidualSize:
        """Measures the residual of a garment after relaxation.

        Args:
            posed: The body.
            vertices: The garment, outside the body [m].
            pinched: Pinched vertices, whose contact yields.
            steps: Number of Newton steps of the relaxation.

        Source: Wu et al., "AgentDress: Realtime Clothing Synthesis for Virtual Agents using Plausible Deformations",
            2021, section 4.2, Table 2. Differs: the relaxation, see `RELAXING_STEPS`.
        """
        size = np.linalg.norm(self.forces(posed, vertices, pinched, steps), axis=1)
        return ResidualSize(float(np.linalg.norm(size)), float(np.median(size)) / self.dressed.model.mean_weight)

    def forces(
        self,
        posed: PosedBody,
        vertices: Vertices,
        pinched: Bool[np.ndarray, " verts"] | None = None,
        steps: int = RELAXING_STEPS,
    ) -> Float[np.ndarray, "verts 3"]:
        """Returns the resultant force on each vertex [N]; see `measure`."""
        stuck = np.zeros(len(vertices), bool) if pinched is None else pinched
        dressed, positions = self.dressed, vertices.astype(np.float64)
        search = EquilibriumSearch(dressed.model, dressed.stepper.workspace, stuck, dressed.scene(posed), None)
        return search.run(positions, None, tolerance=0.0, newton_steps=steps).forces

    def push_out(self, posed: PosedBody, vertices: Vertices) -> tuple[Vertices, Bool[np.ndarray, " verts"]]:
        """Moves a garment out of the body; returns its vertices [m] and a mask of the pinched ones."""
        cleaned = self.end.clean(posed, vertices.astype(np.float64), 1.0)  # independent of earlier poses
        return cleaned.positions, np.isin(np.arange(len(vertices)), cleaned.pinched)
