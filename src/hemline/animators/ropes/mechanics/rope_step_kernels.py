"""One frame of all rope chains, compiled: paper section 3, steps 1 to 4, in substeps."""

import numpy as np

from hemline.collide.primitives.body_primitives import Colliders
from hemline.compiled import kernel

from .joint_frame_kernels import copy_chain_rotations, copy_frames, frames_between
from .kernel_inputs import BodyMotion, Chains, HalfKick, NodeArrays, RopeGeometry, SolverWork, StepSettings
from .kick_kernels import apply_impulses, chain_geometry, chain_work, kick, limit_speeds, measure_ropes
from .placed_kernels import PLACED, place_primitives
from .rope_collision_kernels import resolve_chain
from .rope_force_kernels import external_accelerations, spring_accelerations
from .turn_kernels import move_node


@kernel
def copy_nodes(values, values_out):
    """Copies rows.

    Reads: values (nodes, n).
    Writes: values_out (nodes, n).
    """
    for i in range(values.shape[0]):
        for d in range(values.shape[1]):
            values_out[i, d] = values[i, d]


@kernel
def place_kinematic(kinematic, motion, dt, fraction, positions_out, velocities_out):
    """Places the kinematic nodes at a fraction of the frame, by cubic Hermite interpolation.

    Reads: kinematic (kin,); motion (4, kin, 3): positions at both ends of the frame [m], velocities at both ends [m/s];
        dt: length of the frame [s]; fraction 0..1.
    Writes: positions_out [m], velocities_out [m/s] (nodes, 3): the rows of those nodes.
    """
    s = fraction
    a, b = 1.0 - s * s * (3.0 - 2.0 * s), s * s * (3.0 - 2.0 * s)
    c, d = s * (1.0 - s) * (1.0 - s) * dt, s * s * (s - 1.0) * dt
    e, f, g = 6.0 * s * (1.0 - s) / dt, (1.0 - s) * (1.0 - 3.0 * s), s * (3.0 * s - 2.0)
    for k in range(kinematic.shape[0]):
        i = kinematic[k]
        for x in range(3):
            start, end, first, second = motion[0, k, x], motion[1, k, x], motion[2, k, x], motion[3, k, x]
            positions_out[i, x] = end if s >= 1.0 else a * start + b * end + c * first + d * second
            velocities_out[i, x] = e * (end - start) + f * first + g * second


@kernel
def advance_chains(
    chains: Chains,
    settings: StepSettings,
    colliders: Colliders,
    body: BodyMotion,
    motion,
    push,
    steps,
    nodes_out: NodeArrays,
):
    """Advances all chains by one frame.

    Reads: chains; settings; colliders; body over the frame; motion (4, kin, 3) of the kinematic nodes, as
        `place_kinematic`; push (nodes, 3): further accelerations [m/s^2]; steps: number of substeps.
    Writes: nodes_out: positions, velocities and tensions, from their values before; touched, where a node touched.
    """
    offsets, kinematic, numbers = chains.offsets, chains.kinematic, settings.numbers
    positions_out, velocities_out, dt = nodes_out.positions, nodes_out.velocities, body.duration
    nodes, count, h = positions_out.shape[0], offsets.shape[0] - 1, dt / steps
    springs, accelerations = np.zeros((nodes, 3)), np.zeros((nodes, 3))
    starts, ends = np.zeros((nodes, 3)), np.zeros((nodes, 3))
    pulls = np.zeros(nodes, np.bool_)
    ropes = RopeGeometry(
        np.zeros((nodes, 3)),
        np.zeros(nodes),
        np.zeros(nodes),
        np.zeros(nodes),
        np.zeros(nodes),
        np.zeros(nodes, np.bool_),
    )
    work = SolverWork(
        np.zeros(nodes), np.zeros(nodes), np.zeros(nodes), np.zeros(nodes, np.bool_), np.zeros(nodes, np.bool_)
    )
    chain_rotations, root_velocities = np.zeros((count, 3, 3)), np.zeros((count, 3))
    before, after = body.frames_from.copy(), body.frames_from.copy()
    placed = np.zeros((PLACED, colliders.kinds.shape[0]))
    place_primitives(colliders, before, before, placed)
    place_kinematic(kinematic, motion, dt, 0.0, positions_out, velocities_out)
    copy_chain_rotations(chains.joints, before, chain_rotations)
    measure_ropes(chains, 0, count, positions_out, ropes)
    spring_accelerations(chains, numbers, h, chain_rotations, push, nodes_out.tensions, positions_out, springs)
    for step in range(steps):
        fraction = (step + 1.0) / steps
        copy_nodes(positions_out, starts)
        place_kinematic(kinematic, motion, dt, fraction, positions_out, ends)
        for c in range(count):
            for d in range(3):
                root_velocities[c, d] = (positions_out[offsets[c], d] - starts[offsets[c], d]) / h
        # step 1: half a kick
        external_accelerations(chains, numbers, h, springs, starts, velocities_out, accelerations)
        kick(chains, settings, ropes, HalfKick(h, False, accelerations, root_velocities), nodes_out, pulls, work)
        limit_speeds(offsets, velocities_out)
        # step 2: positions, root to tip; step 3: collisions
        frames_between(body.frames_from, body.frames_to, colliders.pivots, fraction, after)
        place_primitives(colliders, before, after, placed)
        substep = BodyMotion(before, after, h)
        for c in range(count):
            a, b = offsets[c], offsets[c + 1]
            for i in range(a + 1, b):
                move_node(i, chains.lengths[i], pulls[i], settings.project, h, starts, velocities_out, positions_out)
            hit = resolve_chain(chains, c, colliders, placed, substep, settings.contact, starts, nodes_out)
            for d in range(3):
                root_velocities[c, d] = ends[a, d]
            measure_ropes(chains, c, c + 1, positions_out, ropes)
            if hit:
                chain = chain_work(work, b - a)
                for i in range(b - a):
                    chain.signless[i] = False
                apply_impulses(
                    chain_geometry(ropes, a, b), chains.inverse_masses[a:b], settings, h, velocities_out[a:b], chain
                )
        copy_chain_rotations(chains.joints, after, chain_rotations)
        # step 4: the other half
        spring_accelerations(chains, numbers, h, chain_rotations, push, nodes_out.tensions, positions_out, springs)
        external_accelerations(chains, numbers, h, springs, positions_out, velocities_out, accelerations)
        kick(chains, settings, ropes, HalfKick(h, True, accelerations, root_velocities), nodes_out, pulls, work)
        limit_speeds(offsets, velocities_out)
        copy_frames(after, before)
    place_kinematic(kinematic, motion, dt, 1.0, positions_out, velocities_out)
