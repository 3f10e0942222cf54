"""Half a kick of all velocities: tensions, then impulses, paper section 3, steps 1 and 4."""

import math

from hemline.compiled import kernel

from .kernel_inputs import Chains, HalfKick, NodeArrays, RopeGeometry, SolverWork, StepSettings
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


@kernel(inline="always")
def chain_geometry(ropes: RopeGeometry, first, last):
    """Takes the rows of one chain, without a copy.

    Reads: ropes; first, last: its first node, and the node after its last one.
    Returns: the rows of the chain.
    """
    return RopeGeometry(
        ropes.directions[first:last],
        ropes.spans[first:last],
        ropes.slack[first:last],
        ropes.diagonal[first:last],
        ropes.beside[first:last],
        ropes.taut[first:last],
    )


@kernel(inline="always")
def chain_work(work: SolverWork, count):
    """Takes the first places of the working memory, without a copy.

    Reads: work; count: number of places.
    Returns: these places.
    """
    return SolverWork(
        work.wanted[:count], work.upper[:count], work.values[:count], work.active[:count], work.signless[:count]
    )


@kernel(inline="always")
def measure_ropes(chains: Chains, first_chain, last_chain, positions, ropes_out: RopeGeometry):
    """Measures the ropes of some chains and assembles their matrix.

    Reads: chains, from first_chain to last_chain - 1; positions (nodes, 3) [m].
    Writes: ropes_out, the rows of those chains.
    """
    offsets, lengths, inverse_masses = chains.offsets, chains.lengths, chains.inverse_masses
    for c in range(first_chain, last_chain):
        a, b = offsets[c], offsets[c + 1]
        directions, spans, slack, diagonal, beside, taut = chain_geometry(ropes_out, a, b)
        rope_directions(positions[a:b], lengths[a:b], SLACK_TOLERANCE, directions, spans, slack, taut)
        rope_matrix(directions, inverse_masses[a:b], diagonal, beside)


@kernel
def kick(
    chains: Chains,
    settings: StepSettings,
    all_ropes: RopeGeometry,
    half: HalfKick,
    nodes_out: NodeArrays,
    pulls_out,
    all_work: SolverWork,
):
    """Kicks all chains by half a substep: Eq. 2 to 5, then the impulses of Eq. 6 to 9 (steps 1 and 4).

    Reads: chains; settings; all_ropes; half; nodes_out: velocities (of roots at its beginning) and tensions, from
        which the solver starts.
    Writes: nodes_out: velocities, tensions; pulls_out (nodes,): ropes that pull; half: accelerations of the roots;
        all_work.
    """
    offsets, all_masses, velocities_out, tensions_out = (
        chains.offsets,
        chains.inverse_masses,
        nodes_out.velocities,
        nodes_out.tensions,
    )
    h, second_half, accelerations, root_velocities = half
    for c in range(offsets.shape[0] - 1):
        a, b = offsets[c], offsets[c + 1]
        count = b - a
        ropes, work = chain_geometry(all_ropes, a, b), chain_work(all_work, count)
        inverse_masses, v, tensions = all_masses[a:b], velocities_out[a:b], tensions_out[a:b]
        directions, _, _, diagonal, beside, taut = ropes
        wanted, upper, _, active, signless = work
        for d in range(3):
            accelerations[a, d] = (root_velocities[c, d] - v[0, d]) * 2.0 / h
        for i in range(count):
            signless[i] = False
        # how fast the ropes turn half a step later depends on the tensions: first without, then with that
        for attempt in range(2):
            tension_demand(ropes, inverse_masses, tensions, v, accelerations[a:b], h, 0.5 * h * attempt, wanted)
            if settings.tension_sweeps > 0:
                solve_sweeps(diagonal, beside, wanted, taut, signless, settings.tension_sweeps, 1.0, tensions)
            else:
                solve_direct(diagonal, beside, wanted, taut, signless, tensions, active, upper)
        for i in range(count):
            pulls_out[a + i] = i > 0 and tensions[i] > 0.0
            signless[i] = second_half and pulls_out[a + i]
            for d in range(3):
                v[i, d] += 0.5 * h * accelerations[a + i, d]
        apply_tensions(directions, inverse_masses, tensions, 0.5 * h, v)
        apply_impulses(ropes, inverse_masses, settings, h, v, work)


@kernel(inline="always")
def apply_impulses(ropes: RopeGeometry, inverse_masses, settings: StepSettings, h, velocities_out, work: SolverWork):
    """Changes velocities so that no rope lengthens beyond its length, and none of `work.signless` shortens.

    Reads: ropes of one chain; inverse_masses (m + 1,) [1/kg]; settings; h: substep [s]; work.signless (m + 1,).
    Writes: velocities_out (m + 1, 3) [m/s]; the rest of work.
    """
    directions, _, slack, diagonal, beside, taut = ropes
    wanted, upper, impulses, active, signless = work
    impulse_demand(directions, slack, velocities_out, h, wanted)
    for i in range(impulses.shape[0]):
        impulses[i] = 0.0
    if settings.impulse_sweeps > 0:
        solve_sweeps(diagonal, beside, wanted, taut, signless, settings.impulse_sweeps, 0.0, impulses)
    else:
        solve_direct(diagonal, beside, wanted, taut, signless, impulses, active, upper)
    apply_tensions(directions, inverse_masses, impulses, 1.0, velocities_out)


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
