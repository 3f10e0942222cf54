"""One frame of all rope chains, compiled: paper section 3, steps 1 to 4, in substeps."""

import numpy as np

from hemline.compiled import kernel

from .joint_frame_kernels import copy_frames, frames_between, copy_chain_rotations
from .kick_kernels import apply_impulses, kick, limit_speeds, measure_ropes
from .placed_kernels import PLACED, place_primitives
from .rope_collision_kernels import resolve_chain
from .rope_force_kernels import FRICTION, external_accelerations, spring_accelerations
from .turn_kernels import move_node

POSITION, VELOCITY, UPDATE = 2, 3, 4


@kernel
def copy_nodes(values, values_out):
    for i in range(values.shape[0]):
        for d in range(values.shape[1]):
            values_out[i, d] = values[i, d]


@kernel
def place_kinematic(kinematic, motion, dt, share, positions_out, velocities_out):
    # in: kinematic (kin,), motion (4, kin, 3): positions at both ends of the frame, velocities at both ends
    # out: positions and velocities of those nodes at `share` of the frame (cubic Hermite)
    s = share
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
    offsets,
    lengths,
    rest_spans,
    rest_directions,
    inverse_masses,
    margins,
    chain_joints,
    across,
    pairs,
    pair_spans,
    numbers,
    choices,
    kinds,
    joints,
    shapes,
    centres,
    pivots,
    balance,
    rest_loads,
    kinematic,
    motion,
    frames_from,
    frames_to,
    push,
    dt,
    steps,
    positions_out,
    velocities_out,
    tensions_out,
    touched_out,
):
    # model: chains (offsets, lengths, rest state, masses, lateral pairs), numbers and choices, primitives,
    #     balance (nodes, 3) and rest_loads (nodes,)
    # in: motion of the kinematic nodes, frames of the joints at both ends of the frame, push (nodes, 3), dt, substeps
    # in/out: positions_out, velocities_out (nodes, 3), tensions_out (nodes,)   out: touched_out (nodes,)
    nodes, chains, h = positions_out.shape[0], offsets.shape[0] - 1, dt / steps
    springs, accelerations = np.zeros((nodes, 3)), np.zeros((nodes, 3))
    starts, ends, directions = np.zeros((nodes, 3)), np.zeros((nodes, 3)), np.zeros((nodes, 3))
    system, taut, held = np.zeros((4, nodes)), np.zeros(nodes, np.bool_), np.zeros(nodes, np.bool_)
    numbers_work, flags_work = np.zeros((3, nodes)), np.zeros((2, nodes), np.bool_)
    chain_frames, root_velocities = np.zeros((chains, 3, 3)), np.zeros((chains, 3))
    before, after = frames_from.copy(), frames_from.copy()
    placed = np.zeros((PLACED, kinds.shape[0]))
    position_way, velocity_way = float(choices[POSITION]), float(choices[VELOCITY])
    place_primitives(kinds, joints, shapes, centres, before, before, placed)
    place_kinematic(kinematic, motion, dt, 0.0, positions_out, velocities_out)
    copy_chain_rotations(chain_joints, before, chain_frames)
    measure_ropes(offsets, lengths, inverse_masses, positions_out, directions, system, taut)
    spring_accelerations(
        offsets,
        rest_spans,
        rest_directions,
        inverse_masses,
        pairs,
        pair_spans,
        numbers,
        h,
        chain_frames,
        balance,
        rest_loads,
        push,
        tensions_out,
        positions_out,
        springs,
    )
    for step in range(steps):
        share = (step + 1.0) / steps
        copy_nodes(positions_out, starts)
        place_kinematic(kinematic, motion, dt, share, positions_out, ends)
        for c in range(chains):
            for d in range(3):
                root_velocities[c, d] = (positions_out[offsets[c], d] - starts[offsets[c], d]) / h
        # step 1: half a kick
        external_accelerations(
            offsets, across, inverse_masses, numbers, h, springs, starts, velocities_out, accelerations
        )
        kick(
            offsets,
            inverse_masses,
            choices,
            h,
            accelerations,
            root_velocities,
            0.0,
            directions,
            system,
            taut,
            velocities_out,
            tensions_out,
            held,
            numbers_work,
            flags_work,
        )
        limit_speeds(offsets, velocities_out)
        # step 2: positions, root to tip; step 3: collisions
        frames_between(frames_from, frames_to, pivots, share, after)
        place_primitives(kinds, joints, shapes, centres, before, after, placed)
        for c in range(chains):
            a, b = offsets[c], offsets[c + 1]
            for i in range(a + 1, b):
                move_node(i, lengths[i], held[i], choices[UPDATE] > 0, h, starts, velocities_out, positions_out)
            hit = resolve_chain(
                a,
                b,
                lengths,
                margins,
                kinds,
                joints,
                shapes,
                placed,
                before,
                after,
                numbers[FRICTION],
                position_way,
                velocity_way,
                h,
                starts,
                positions_out,
                velocities_out,
                touched_out,
            )
            for d in range(3):
                root_velocities[c, d] = ends[a, d]
            measure_ropes(offsets[c : c + 2], lengths, inverse_masses, positions_out, directions, system, taut)
            if hit:
                for i in range(b - a):
                    flags_work[1, i] = False
                apply_impulses(
                    directions[a:b],
                    inverse_masses[a:b],
                    system[1:, a:b],
                    taut[a:b],
                    flags_work[1, : b - a],
                    choices,
                    h,
                    velocities_out[a:b],
                    numbers_work,
                    flags_work[0, : b - a],
                )
        copy_chain_rotations(chain_joints, after, chain_frames)
        # step 4: the other half
        spring_accelerations(
            offsets,
            rest_spans,
            rest_directions,
            inverse_masses,
            pairs,
            pair_spans,
            numbers,
            h,
            chain_frames,
            balance,
            rest_loads,
            push,
            tensions_out,
            positions_out,
            springs,
        )
        external_accelerations(
            offsets, across, inverse_masses, numbers, h, springs, positions_out, velocities_out, accelerations
        )
        kick(
            offsets,
            inverse_masses,
            choices,
            h,
            accelerations,
            root_velocities,
            1.0,
            directions,
            system,
            taut,
            velocities_out,
            tensions_out,
            held,
            numbers_work,
            flags_work,
        )
        limit_speeds(offsets, velocities_out)
        copy_frames(after, before)
    place_kinematic(kinematic, motion, dt, 1.0, positions_out, velocities_out)
