"""The potential of one step: the sum of its terms, with gradient and Hessian."""

from collections.abc import Sequence

import numpy as np

from hemline.sim.cloth.air_kernels import Air
from hemline.sim.cloth.inertia_kernels import Inertia
from hemline.sim.cloth.membrane_kernels import green_strain
from hemline.sim.cloth.sheet import Positions
from hemline.sim.contact.body.load_kernels import SkinContact
from hemline.sim.contact.pairs.pairs import Pairs
from hemline.sim.solver.conjugate_kernels import PairBlocks
from hemline.sim.step.terms.air import constant_force
from hemline.sim.step.terms.bending import Bending
from hemline.sim.step.terms.contact_pairs import NO_PAIR_BLOCKS, ContactPairs
from hemline.sim.step.terms.inertia import no_inertia
from hemline.sim.step.terms.membrane import Membrane
from hemline.sim.step.terms.skin_contact import no_contact
from hemline.sim.step.terms.term import Term

from .model import ClothModel
from .vertex_kernels import diagonal_blocks, gradient
from .workspace import Workspace


class Potential:
    r"""The energy that a step minimises.

    $$E(x) = E_{inertia} + E_{membrane} + E_{bending} + E_{air} + E_{contact} + E_{pairs} + \sum_t E_t$$

    Each term is a file in `terms`; no term depends on another. Inertia, air and contact with the body act on each
    vertex alone. They are arrays, and the kernels in `vertex_kernels` evaluate them together in one pass. The other
    terms evaluate themselves; the additional ones, $E_t$, implement `Term`. Kernels that are called in each evaluation
    get plain tuples of what they only read: a named tuple costs half a microsecond more.

    Args:
        model: The sheet.
        workspace: Arrays that every evaluation overwrites; `evaluate` leaves the gradient there.
        start: The cloth at the start of the step, the reference of strain rates [m].
        over_h: 1 / h [1/s].
        cap: Compression that stays in the Hessian [N m].
        inertia, air, contact: Terms of the fused kernel.
        terms: Additional terms.

    Attributes:
        x: Positions of the last evaluation [m].
        energy: Energy at these positions [J].
        residual_share: Mean norm of the gradient at free vertices, divided by the mean weight of a vertex.
        pairs: Contact in pairs, or None.
    """

    def __init__(
        self,
        model: ClothModel,
        workspace: Workspace,
        *,
        start: Positions,
        over_h: float,
        cap: np.ndarray,
        inertia: Inertia,
        air: Air,
        contact: SkinContact,
        terms: Sequence[Term] = (),
    ):
        self.model, self.workspace = model, workspace
        self.membrane, self.bending = Membrane(model, workspace, over_h, cap), Bending(model, workspace)
        self.inertia, self.air, self.contact, self.terms = inertia, air, contact, terms
        self.pairs: ContactPairs | None = None
        green_strain(start, model.sheet.faces, model.sheet.shape, workspace.strain_start)

    def replace_pairs(self, pairs: Pairs | None) -> None:
        """Uses other pairs from the next evaluation on; None keeps the current ones."""
        if pairs is not None:
            self.pairs = ContactPairs(pairs, self.contact.creep)

    def evaluate(self, x: Positions) -> None:
        """Computes energy, gradient and residual at some positions."""
        self.x = x
        self._elastic_energy = float(sum((self.membrane.evaluate(x), *self.bending.evaluate(x))))
        self.evaluate_contact()

    def evaluate_contact(self) -> None:
        """Computes energy, gradient and residual again after contact has changed and the cloth has not moved."""
        model, work = self.model, self.workspace
        np.copyto(work.pressed, work.elastic)
        pair_energy = 0.0 if self.pairs is None else self.pairs.evaluate(self.x, work.pressed)
        term_energy = sum(term.evaluate(self.x, work.pressed) for term in self.terms)
        gradient(
            self.x,
            work.pressed,
            tuple(self.inertia),
            tuple(self.air),
            tuple(self.contact),
            model.fixed,
            work.evaluation,
        )
        self.energy = self._elastic_energy + float(work.evaluation.energy.sum()) + pair_energy + term_energy
        free = max(1, model.sheet.vertex_count - len(model.pinned))
        self.residual_share = float(work.evaluation.residual.sum()) / free / model.mean_weight

    def assemble(self) -> PairBlocks:
        """Writes the Hessian at the last positions into the workspace's system; returns the blocks of the pairs."""
        model, work = self.model, self.workspace
        system, layout = work.system, model.layout
        air = self.air
        if self.terms:
            # the kernel adds the air's matrix to the diagonal unchanged, so the blocks of additional terms go there too
            air = air._replace(matrix=air.matrix.copy())
            for term in self.terms:
                term.add_blocks(self.x, air.matrix)
        vertex_terms = tuple(self.inertia), tuple(air), tuple(self.contact)
        if self.pairs is None:
            work.pair_diagonal[:] = 0
            pairs = NO_PAIR_BLOCKS
        else:
            pairs = self.pairs.blocks(self.x, layout, work.pair_diagonal)
        self.membrane.blocks(layout.ring_bending, system.matrix.blocks)
        where = tuple(system.pattern), tuple(system.matrix)
        diagonal_blocks(self.x, *vertex_terms, model.fixed, work.pair_diagonal, *where)
        return pairs


def elastic_potential(model: ClothModel, workspace: Workspace, positions: Positions) -> Potential:
    """Returns the potential of membrane and bending alone, evaluated at some positions."""
    count = len(positions)
    potential = Potential(
        model,
        workspace,
        start=positions,
        over_h=0.0,
        cap=np.zeros(len(model.cap)),
        inertia=no_inertia(positions),
        air=constant_force(positions, np.zeros((count, 3))),
        contact=no_contact(count, model.settings),
    )
    potential.evaluate(positions)
    return potential
