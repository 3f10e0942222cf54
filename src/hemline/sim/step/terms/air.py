"""Drag and lift of the air during a step."""

import numpy as np

from hemline.sim.cloth.air_kernels import Air, air_at_vertices, air_by_triangle
from hemline.sim.cloth.sheet import Positions
from hemline.sim.step.model import ClothModel
from hemline.sim.step.state import ClothState
from hemline.sim.step.workspace import Workspace


def air_term(model: ClothModel, workspace: Workspace, state: ClothState, h: float) -> Air:
    r"""Returns the air on each vertex, linear in its velocity over the step.

    $$E(x) = \sum_i -f_i \cdot s_i + \tfrac12\, s_i \cdot \frac{D_i}{h} s_i, \qquad s = x - x_0$$

    in J, with $f = F(v_0) + D v_0$ and $D = -\partial F / \partial v$ symmetric and positive. $F$ is drag and lift, see
    `air_kernels.air_by_triangle`. Value and gradient: `air_kernels.air_terms`, called in `vertex_kernels.gradient`;
    block $D_i / h$: `m` in `vertex_kernels.diagonal_blocks`.

    Args:
        model: The sheet and the wind.
        workspace: Holds the returned arrays, which are valid until the next step.
        state: The state at the start of the step.
        h: Length of the step [s].
    """
    sheet, (force, matrix) = model.sheet, workspace.air
    if not (sheet.drag.any() or sheet.lift.any()):
        force[:], matrix[:] = 0, 0
        return Air(state.positions, force, matrix)
    wind, half = model.wind(state.time, state.positions), 0.5 * model.settings.air_density
    x, velocities, triangles = state.positions, state.velocities, workspace.air_by_triangle
    air_by_triangle(x, velocities, wind, sheet.faces, sheet.drag, sheet.lift, half, triangles)
    air_at_vertices(sheet.corners, triangles, velocities, 1 / h, force, matrix)
    return Air(x, force, matrix)


def constant_force(positions: Positions, force: Positions) -> Air:
    """Returns a force that does not depend on velocity, such as weight or none, in the form of `air_term` [N]."""
    return Air(positions, force, np.zeros((len(positions), 6)))
