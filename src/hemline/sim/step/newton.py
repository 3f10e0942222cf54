"""One Newton step: the Hessian, conjugate gradients, a line search; of steps in time and of the static solve."""

from typing import NamedTuple

import numpy as np

from .potential import Potential
from .state import StepRejected
from .vertex_kernels import step_along, write_right_side

MAX_LINE_HALVINGS = 8
"""How often a Newton step is halved, at most."""


class NewtonStep(NamedTuple):
    """A Newton step.

    Attributes:
        share: How much of it the line search took; 0: none.
        solver_steps: Steps of conjugate gradients.
    """

    share: float
    solver_steps: int


def newton_step(potential: Potential, *, fresh: bool, solver_share: float, solver_steps: int) -> NewtonStep:
    r"""Move a potential towards its minimum: $x \leftarrow x - s H^{-1} \nabla E$, $s$ the largest of 1, 1/2, 1/4, ...
    with which the energy does not grow.

    Args:
        potential: Evaluated; afterwards it is where the line search ended.
        fresh: Build the coarse level of the preconditioner; otherwise the last one serves: that of a step's first
            Hessian is good enough for the whole step.
        solver_share: Conjugate gradients stop when the preconditioned residual has fallen to this share.
        solver_steps: How many of their steps are taken at most.

    Raises:
        StepRejected: The Hessian is not positive.
    """
    system, slot = potential.workspace.system, potential.model.layout.slot
    pairs = potential.assemble()
    if fresh and not system.coarsen():
        raise StepRejected("the Hessian is not positive")
    write_right_side(potential.workspace.gradient, slot, system.right)
    spent = system.solve(pairs, share=solver_share, steps=solver_steps)
    return NewtonStep(_line_search(potential), spent)


def _line_search(potential: Potential) -> float:
    """Go along the solution as far as the energy falls; the share that was taken."""
    solution, slot = potential.workspace.system.vectors.solution, potential.model.layout.slot
    before, energy, x = potential.x, potential.energy, np.empty_like(potential.x)
    for halving in range(MAX_LINE_HALVINGS):
        share = 0.5**halving
        step_along(before, share, solution, slot, x)
        potential.evaluate(x)
        if potential.energy <= energy + 1e-10 * abs(energy):
            return share
    potential.evaluate(before)
    return 0.0
