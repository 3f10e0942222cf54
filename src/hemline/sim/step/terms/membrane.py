"""Stretch and shear of the cloth, with their damping."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from hemline.sim.cloth.membrane_kernels import membrane, membrane_blocks
from hemline.sim.cloth.sheet import Positions
from hemline.sim.step.model import ClothModel
from hemline.sim.step.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Membrane:
    r"""St. Venant-Kirchhoff triangles with stiffness-proportional damping.

    $$E(x) = \sum_f \frac{A_f}{2} \left(E : C : E + \frac{d}{h}\,(E - E_0) : C : (E - E_0)\right), \qquad
      E = \tfrac12 (F^T F - I)$$

    in J, with $C$ isotropic plane stress, $d$ the time constant of damping [s], and $E_0$ the strain at the start of
    the step. The blocks are the derivatives of the gradient, except that compression beyond a cap (`ClothModel.cap`
    divided by $h^2$) is left out of the stress; inertia keeps what remains positive definite.

    Attributes:
        model: The sheet.
        workspace: Holds the strain at the start of the step; `evaluate` writes its `stretch`.
        over_h: 1 / h [1/s]; 0 for no damping.
        cap: Compression that stays in the Hessian [N m].

    Source: Volino, Magnenat-Thalmann, Faure, "A simple approach to nonlinear tensile stiffness for accurate cloth
        simulation", 2009.
    """

    model: ClothModel
    workspace: Workspace
    over_h: float
    cap: Float[np.ndarray, " faces"]

    def evaluate(self, x: Positions) -> float:
        """Returns the energy [J]; leaves the gradient at the corners of the triangles in `workspace.stretch.corner`
        [N].
        """
        work = self.workspace
        membrane(x, tuple(self.model.fabric), work.strain_start, self.over_h, self.cap, work.stretch)
        return work.stretch.energy.sum()

    def blocks(self, ring_bending: Float[np.ndarray, " ring"], out: Float[np.ndarray, " entries9"]) -> None:
        """Writes the off-diagonal blocks at the last evaluation, added to the entries of bending.

        Each diagonal block is minus the sum of its row, see `vertex_kernels.diagonal_blocks`.

        Args:
            ring_bending: The bending matrix on the ring, in the solver's order [N/m].
            out: Blocks in the solver's order.
        """
        sheet, layout = self.model.sheet, self.model.layout
        membrane_blocks(
            tuple(sheet.edge_corners),
            layout.edge_slots,
            tuple(self.model.fabric),
            tuple(self.workspace.stretch),
            self.over_h,
            ring_bending,
            out,
        )
