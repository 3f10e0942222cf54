"""Bending of the cloth: a constant matrix, or hinges where the rest shape is not flat."""

from dataclasses import dataclass

from hemline.sim.cloth.elastic_kernels import elastic_at_vertices
from hemline.sim.cloth.hinge_kernels import hinge_forces, hinges_at_vertices
from hemline.sim.cloth.sheet import Positions
from hemline.sim.step.model import ClothModel
from hemline.sim.step.workspace import Workspace


@dataclass(frozen=True, eq=False)
class Bending:
    r"""Isometric bending of a flat rest shape, or discrete-shell bending of one that is not flat.

    $$E(x) = -\frac14 \sum_{i \ne j} q_{ij} |x_i - x_j|^2, \qquad\text{or}\qquad
      E(x) = \sum_e \frac{w_e}{2} \left(2 \sin\frac{\theta_e}{2} - 2 \sin\frac{\bar\theta_e}{2}\right)^2$$

    in J, with $q$ the off-diagonal entries of the bending matrix [N/m]. The blocks are $q_{ij} I$ in both cases. For
    direct neighbours (the ring), `Membrane.blocks` starts from them; beyond, they are the solver's `far_bending`.

    Attributes:
        model: The sheet.
        workspace: Arrays that every evaluation overwrites.

    Source: Bergou et al., "A quadratic bending model for inextensible surfaces", SGP 2006; Grinspun et al., "Discrete
        shells", SCA 2003, Eq. 4. Differs: see `hinge_kernels`.
    """

    model: ClothModel
    workspace: Workspace

    def evaluate(self, x: Positions) -> tuple[float, float]:
        """Returns the energies of hinges and of the matrix [J]; leaves the gradient at the vertices in
        `workspace.elastic` [N].

        That gradient includes the membrane: both are summed in one pass over the vertices,
        `elastic_kernels.elastic_at_vertices`.
        """
        model, work = self.model, self.workspace
        sheet = model.sheet
        if len(sheet.hinge_rest):
            gradient, energy = work.hinge_gradient, work.hinge_energy
            hinge_forces(x, sheet.hinges, sheet.hinge_weight, model.hinge_rest, gradient, energy)
            hinges_at_vertices(tuple(model.hinge_corners), gradient, work.bent)
        corners, matrix = tuple(sheet.corners), tuple(model.bending)
        elastic_at_vertices(x, corners, work.stretch.corner, matrix, work.bent, work.elastic, work.bending_energy)
        return work.hinge_energy.sum(), work.bending_energy.sum()
