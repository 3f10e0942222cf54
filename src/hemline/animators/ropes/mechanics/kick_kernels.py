"""Half a kick of all velocities: tensions, then impulses, paper section 3, steps 1 and 4."""

import math

from hemline.compiled import kernel

from .kernel_inputs import Chains, Nodes, RopeGeometry, SolverWork, StepSettings
from .tension_kernels import (
    apply_tensions,
    impulse_demand,
    rope_directions,
    rope_matrix,
    solve_direct,
    solve_sweeps,
    tension_demand,
)

SLACK_TOLERANCE = 0.01
"""A rope may pull when its span is at least (1 - this) of its length, as much as it must to be taut a step later."""
SPEED_LIMIT = 200.0
"""No node moves faster relative to its chain's root [m/s]; far above anything that cloth does."""


@kernel
def chain_geometry(ropes: RopeGeometry, first, last):
    """Returns the rows of one chain, from node first to last - 1, without a copy."""
    return RopeGeometry(
        ropes.directions[first:last],
        ropes.spans[first:last],
        ropes.slack[first:last],
        ropes.diagonal[first:last],
        ropes.beside[first:last],
        ropes.taut[first:last],
    )


@kernel
def chain_work(work: SolverWork, count):
    """Returns the first count places of the working memory, without a copy."""
    return SolverWork(
        work.wanted[:count], work.upper[:count], work.values[:count], work.active[:count], work.signless[:count]
    )


@kernel
def measure_ropes(chains: Chains, first_chain, last_chain, positions, ropes_out: RopeGeometry):
    """Measures the ropes of some chains and assembles their matrix.

    Reads: chains, from first_chain to last_chain - 1; positions (nodes, 3) [m].
    Writes: ropes_out, the rows of those chains.
    """
    for c in range(first_chain, last_chain):
        a, b = chains.offsets[c], chains.offsets[c + 1]
        ropes = chain_geometry(ropes_out, a, b)
        rope_directions(
            positions[a:b],
            chains.lengths[a:b],
            SLACK_TOLERANCE,
            ropes.directions,
            ropes.spans,
            ropes.slack,
            ropes.taut,
        )
        rope_matrix(ropes.directions, chains.inverse_masses[a:b], ropes.diagonal, ropes.beside)


@kernel
def kick(
    chains: Chains,
    settings: StepSettings,
    all_ropes: RopeGeometry,
    h,
    second_half,
    accelerations,
    root_velocities,
    nodes_out: Nodes,
    pulls_out,
    all_work: SolverWork,
):
    """Kicks all chains by half a substep: Eq. 2 to 5, then the impulses of Eq. 6 to 9 (steps 1 and 4).

    Reads: chains; settings; all_ropes; h: substep [s]; second_half: whether this half ends the substep; accelerations
        (nodes, 3): external ones [m/s^2]; root_velocities (chains, 3) at the end of this half [m/s]; nodes_out:
        velocities (of roots at its beginning) and tensions, from which the solver starts.
    Writes: nodes_out: velocities, tensions; pulls_out (nodes,): ropes that pull; accelerations of the roots; all_work.
    """
    for c in range(chains.offsets.shape[0] - 1):
        a, b = chains.offsets[c], chains.offsets[c + 1]
        count = b - a
        ropes, work, inverse_masses = (
            chain_geometry(all_ropes, a, b),
            chain_work(all_work, count),
            chains.inverse_masses[a:b],
        )
        v, tensions = nodes_out.velocities[a:b], nodes_out.tensions[a:b]
        for d in range(3):
            accelerations[a, d] = (root_velocities[c, d] - v[0, d]) * 2.0 / h
        for i in range(count):
            work.signless[i] = False
        # how fast the ropes turn half a step later depends on the tensions: first without, then with that
        for attempt in range(2):
            tension_demand(
                ropes, inverse_masses, tensions, v, accelerations[a:b], h, 0.5 * h * attempt, work.wanted
            )
            if settings.tension_sweeps > 0:
                solve_sweeps(
                    ropes.diagonal,
                    ropes.beside,
                    work.wanted,
                    ropes.taut,
                    work.signless,
                    settings.tension_sweeps,
                    1.0,
                    tensions,
                )
            else:
                solve_direct(
                    ropes.diagonal,
                    ropes.beside,
                    work.wanted,
                    ropes.taut,
                    work.signless,
                    tensions,
                    work.active,
                    work.upper,
                )
        for i in range(count):
            pulls_out[a + i] = i > 0 and tensions[i] > 0.0
            work.signless[i] = second_half and pulls_out[a + i]
            for d in range(3):
                v[i, d] += 0.5 * h * accelerations[a + i, d]
        apply_tensions(ropes.directions, inverse_masses, tensions, 0.5 * h, v)
        apply_impulses(ropes, inverse_masses, settings, h, v, work)


@kernel
def apply_impulses(
    ropes: RopeGeometry, inverse_masses, settings: StepSettings, h, velocities_out, work: SolverWork
):
    """Changes velocities so that no rope lengthens beyond its length, and none of `work.signless` shortens.

    Reads: ropes of one chain; inverse_masses (m + 1,) [1/kg]; settings; h: substep [s]; work.signless (m + 1,).
    Writes: velocities_out (m + 1, 3) [m/s]; the rest of work.
    """
    impulse_demand(ropes.directions, ropes.slack, velocities_out, h, work.wanted)
    for i in range(work.values.shape[0]):
        work.values[i] = 0.0
    if settings.impulse_sweeps > 0:
        solve_sweeps(
            ropes.diagonal,
            ropes.beside,
            work.wanted,
            ropes.taut,
            work.signless,
            settings.impulse_sweeps,
            0.0,
            work.values,
        )
    else:
        solve_direct(
            ropes.diagonal,
            ropes.beside,
            work.wanted,
            ropes.taut,
            work.signless,
            work.values,
            work.active,
            work.upper,
        )
    apply_tensions(ropes.directions, inverse_masses, work.values, 1.0, velocities_out)


@kernel
def limit_speeds(offsets, velocities_out):
    """Limits the speed of each node relative to its chain's root to `SPEED_LIMIT`.

    Reads: offsets (chains + 1,).
    Writes: velocities_out (nodes, 3) [m/s].
    """
    for c in range(offsets.shape[0] - 1):
        r = offsets[c]
        for i in range(r + 1, offsets[c + 1]):
            x, y, z = (
                velocities_out[i, 0] - velocities_out[r, 0],
                velocities_out[i, 1] - velocities_out[r, 1],
                velocities_out[i, 2] - velocities_out[r, 2],
            )
            speed = math.sqrt(x * x + y * y + z * z)
            if speed > SPEED_LIMIT:
                ratio = SPEED_LIMIT / speed
                velocities_out[i, 0] = velocities_out[r, 0] + ratio * x
                velocities_out[i, 1] = velocities_out[r, 1] + ratio * y
                velocities_out[i, 2] = velocities_out[r, 2] + ratio * z
