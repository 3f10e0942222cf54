"""One Newton step, for time steps and for the static solve: Hessian, conjugate gradients, line search."""

from typing import NamedTuple

import numpy as np

from .potential import Potential
from .state import StepRejected
from .vertex_kernels import step_along, write_right_side

MAX_LINE_HALVINGS = 8
"""Maximum number of halvings of a Newton step."""


class NewtonStep(NamedTuple):
    """The result of a Newton step.

    Attributes:
        fraction: Fraction of the step that the line search took; 0 for none.
        solver_steps: Number of steps of conjugate gradients.
    """

    fraction: float
    solver_steps: int


def newton_step(potential: Potential, *, fresh: bool, solver_share: float, solver_steps: int) -> NewtonStep:
    r"""Moves a potential towards its minimum: $x \leftarrow x - s H^{-1} \nabla E$, $s$ the largest of 1, 1/2, 1/4, ...
    for which the energy does not grow.

    Args:
        potential: The potential, already evaluated. Afterwards it is evaluated where the line search ended.
        fresh: Whether to rebuild the coarse level of the preconditioner. Otherwise the last one is used: the one
            built from the first Hessian of a step is good enough for the whole step.
        solver_share: Conjugate gradients stop when the preconditioned residual has fallen to this fraction.
        solver_steps: Maximum number of steps of conjugate gradients.

    Raises:
        StepRejected: The Hessian is not positive.
    """
    system, slot = potential.workspace.system, potential.model.layout.slot
    pairs = potential.assemble()
    if fresh and not system.coarsen():
        raise StepRejected("the Hessian is not positive")
    write_right_side(potential.workspace.evaluation.gradient, slot, system.vectors.right)
    spent = system.solve(pairs, tolerance=solver_share, steps=solver_steps)
    return NewtonStep(_line_search(potential), spent)


def _line_search(potential: Potential) -> float:
    """Moves along the solution as long as the energy falls; returns the fraction taken."""
    solution, slot = potential.workspace.system.vectors.solution, potential.model.layout.slot
    before, energy, x = potential.x, potential.energy, np.empty_like(potential.x)
    for halving in range(MAX_LINE_HALVINGS):
        fraction = 0.5**halving
        step_along(before, fraction, solution, slot, x)
        potential.evaluate(x)
        if potential.energy <= energy + 1e-10 * abs(energy):
            return fraction
    potential.evaluate(before)
    return 0.0
