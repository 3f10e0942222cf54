"""Inertia of a step, with the springs of soft pins."""

import numpy as np

from hemline.sim.cloth.inertia_kernels import Inertia
from hemline.sim.cloth.sheet import Positions
from hemline.sim.step.model import ClothModel
from hemline.sim.step.state import ClothState


def inertia_term(model: ClothModel, state: ClothState, h: float, targets: Positions) -> Inertia:
    r"""Returns inertia in a step of backward Euler, and the springs of soft pins, as one parabola per vertex.

    $$E(x) = \sum_i \frac{k_i}{2} |x_i - y_i|^2, \qquad k = \frac{m}{h^2}, \quad y = x_0 + h v + h^2 g$$

    in J. For a vertex with a soft pin of stiffness $s$ towards $p$, $k = m/h^2 + s$ and $y$ is the weighted mean of
    both goals. The goal of a hard pin is its target. Value and gradient: `inertia_kernels.inertia_terms`, called in
    `vertex_kernels.gradient`; block $k_i I$: `a` in `vertex_kernels.diagonal_blocks`.

    Args:
        model: The sheet and its pins.
        state: The state at the start of the step.
        h: Length of the step [s].
        targets: Targets of the pins [m].

    Source: Martin et al., "Example-based elastic materials", ACM TOG 30(4), 2011: implicit Euler as a minimisation.
    """
    over_h = 1 / h
    stiffness = model.sheet.mass * over_h**2
    goal = state.positions + h * state.velocities + h**2 * np.array(model.settings.gravity)
    goal[model.pinned] = targets[model.hard]
    pins, spring = model.soft_pins, model.spring[:, None]
    inertia = stiffness[pins, None]
    goal[pins] = (inertia * goal[pins] + spring * targets[~model.hard]) / (inertia + spring)
    stiffness[pins] += model.spring
    return Inertia(goal, stiffness)


def no_inertia(positions: Positions) -> Inertia:
    """Returns no inertia, for a static solve, in the form of `inertia_term`."""
    return Inertia(positions, np.zeros(len(positions)))
