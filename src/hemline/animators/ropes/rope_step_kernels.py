"""One frame of all rope chains, compiled: paper section 3, steps 1 to 4, in substeps."""

import math

import numpy as np

from hemline.compiled import kernel

from .rope_collision_kernels import PLACED, place_primitives, resolve_chain, to_world
from .rope_force_kernels import FRICTION, external_accelerations, spring_accelerations
from .tension_kernels import (
    impulse_demand,
    pull,
    rope_directions,
    rope_matrix,
    solve_direct,
    solve_sweeps,
    tension_demand,
)

TENSION_SWEEPS, IMPULSE_SWEEPS, POSITION, VELOCITY = 0, 1, 2, 3
SLACKNESS = 1e-5
"""A rope is taut when its span is at least (1 - this) of its length."""
SPEED_LIMIT = 200.0
"""No node moves faster relative to its chain's root [m/s]; far above anything that cloth does."""


@kernel
def quaternion_of(frames, j):
    # in: frames (joints, 3, 4)   returns: w, x, y, z of the rotation of joint j
    a, b, c = frames[j, 0, 0], frames[j, 1, 1], frames[j, 2, 2]
    if a + b + c > 0.0:
        s = 2.0 * math.sqrt(1.0 + a + b + c)
        return (
            s / 4.0,
            (frames[j, 2, 1] - frames[j, 1, 2]) / s,
            (frames[j, 0, 2] - frames[j, 2, 0]) / s,
            (frames[j, 1, 0] - frames[j, 0, 1]) / s,
        )
    if a >= b and a >= c:
        s = 2.0 * math.sqrt(1.0 + a - b - c)
        return (
            (frames[j, 2, 1] - frames[j, 1, 2]) / s,
            s / 4.0,
            (frames[j, 0, 1] + frames[j, 1, 0]) / s,
            (frames[j, 0, 2] + frames[j, 2, 0]) / s,
        )
    if b >= c:
        s = 2.0 * math.sqrt(1.0 - a + b - c)
        return (
            (frames[j, 0, 2] - frames[j, 2, 0]) / s,
            (frames[j, 0, 1] + frames[j, 1, 0]) / s,
            s / 4.0,
            (frames[j, 1, 2] + frames[j, 2, 1]) / s,
        )
    s = 2.0 * math.sqrt(1.0 - a - b + c)
    return (
        (frames[j, 1, 0] - frames[j, 0, 1]) / s,
        (frames[j, 0, 2] + frames[j, 2, 0]) / s,
        (frames[j, 1, 2] + frames[j, 2, 1]) / s,
        s / 4.0,
    )


@kernel
def copy_frames(frames, frames_out):
    for j in range(frames.shape[0]):
        for a in range(3):
            for b in range(4):
                frames_out[j, a, b] = frames[j, a, b]


@kernel
def copy_nodes(values, values_out):
    for i in range(values.shape[0]):
        for d in range(values.shape[1]):
            values_out[i, d] = values[i, d]


@kernel
def frames_between(frames_from, frames_to, pivots, share, frames_out):
    # in: two poses of the joints, share 0..1
    # out: frames_out between them: pivots on straight lines, rotations by slerp
    if share >= 1.0:
        copy_frames(frames_to, frames_out)
        return
    for j in range(pivots.shape[0]):
        w0, x0, y0, z0 = quaternion_of(frames_from, j)
        w1, x1, y1, z1 = quaternion_of(frames_to, j)
        dot = w0 * w1 + x0 * x1 + y0 * y1 + z0 * z1
        sign = 1.0 if dot >= 0.0 else -1.0
        angle = math.acos(min(abs(dot), 1.0))
        first, second = 1.0 - share, share * sign
        if angle > 1e-6:
            first, second = (
                math.sin((1.0 - share) * angle) / math.sin(angle),
                sign * math.sin(share * angle) / math.sin(angle),
            )
        w, x, y, z = (
            first * w0 + second * w1,
            first * x0 + second * x1,
            first * y0 + second * y1,
            first * z0 + second * z1,
        )
        n = 2.0 / max(w * w + x * x + y * y + z * z, 1e-30)
        frames_out[j, 0, 0], frames_out[j, 0, 1], frames_out[j, 0, 2] = (
            1.0 - n * (y * y + z * z),
            n * (x * y - w * z),
            n * (x * z + w * y),
        )
        frames_out[j, 1, 0], frames_out[j, 1, 1], frames_out[j, 1, 2] = (
            n * (x * y + w * z),
            1.0 - n * (x * x + z * z),
            n * (y * z - w * x),
        )
        frames_out[j, 2, 0], frames_out[j, 2, 1], frames_out[j, 2, 2] = (
            n * (x * z - w * y),
            n * (y * z + w * x),
            1.0 - n * (x * x + y * y),
        )
        px, py, pz = pivots[j, 0], pivots[j, 1], pivots[j, 2]
        ax, ay, az = to_world(frames_from, j, px, py, pz)
        bx, by, bz = to_world(frames_to, j, px, py, pz)
        frames_out[j, 0, 3] = (
            ax + share * (bx - ax) - (frames_out[j, 0, 0] * px + frames_out[j, 0, 1] * py + frames_out[j, 0, 2] * pz)
        )
        frames_out[j, 1, 3] = (
            ay + share * (by - ay) - (frames_out[j, 1, 0] * px + frames_out[j, 1, 1] * py + frames_out[j, 1, 2] * pz)
        )
        frames_out[j, 2, 3] = (
            az + share * (bz - az) - (frames_out[j, 2, 0] * px + frames_out[j, 2, 1] * py + frames_out[j, 2, 2] * pz)
        )


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
def read_geometry(offsets, lengths, inverse_masses, positions, directions_out, system_out, taut_out):
    # model: chains   in: positions (nodes, 3)   out: directions_out (nodes, 3), taut_out (nodes,),
    #     system_out (3, nodes): spans, diagonal and side of the matrix
    for c in range(offsets.shape[0] - 1):
        a, b = offsets[c], offsets[c + 1]
        rope_directions(positions[a:b], lengths[a:b], SLACKNESS, directions_out[a:b], system_out[0, a:b], taut_out[a:b])
        rope_matrix(directions_out[a:b], inverse_masses[a:b], system_out[1, a:b], system_out[2, a:b])


@kernel
def kick(
    offsets,
    inverse_masses,
    choices,
    h,
    accelerations,
    root_velocities,
    second,
    directions,
    system,
    taut,
    velocities_out,
    tensions_out,
    held_out,
    numbers_work,
    flags_work,
):
    # model: chains   in: external accelerations (nodes, 3); root_velocities (chains, 3) at the end of this half step;
    #     second: 1.0 for the half step that ends the step; the geometry
    # in/out: velocities_out (roots at its beginning), tensions_out (warm)   out: held_out (nodes,) ropes that pull
    # Steps 1 and 4: Eq. 2 to 5, then the impulses of Eq. 6 to 9.
    for c in range(offsets.shape[0] - 1):
        a, b = offsets[c], offsets[c + 1]
        count = b - a
        wanted, upper, active = numbers_work[0, :count], numbers_work[1, :count], flags_work[0, :count]
        free, v, tensions = flags_work[1, :count], velocities_out[a:b], tensions_out[a:b]
        for d in range(3):
            accelerations[a, d] = (root_velocities[c, d] - v[0, d]) * 2.0 / h
        tension_demand(directions[a:b], system[0, a:b], v, accelerations[a:b], h, wanted)
        for i in range(count):
            free[i] = False
        if choices[TENSION_SWEEPS] > 0:
            solve_sweeps(
                system[1, a:b], system[2, a:b], wanted, taut[a:b], free, choices[TENSION_SWEEPS], 1.0, tensions
            )
        else:
            solve_direct(system[1, a:b], system[2, a:b], wanted, taut[a:b], free, tensions, active, upper)
        for i in range(count):
            held_out[a + i] = i > 0 and tensions[i] > 0.0
            free[i] = second > 0.0 and held_out[a + i]
            for d in range(3):
                v[i, d] += 0.5 * h * accelerations[a + i, d]
        pull(directions[a:b], inverse_masses[a:b], tensions, 0.5 * h, v)
        apply_impulses(
            directions[a:b],
            inverse_masses[a:b],
            system[1, a:b],
            system[2, a:b],
            taut[a:b],
            free,
            choices,
            v,
            numbers_work,
            active,
        )


@kernel
def apply_impulses(
    directions, inverse_masses, diagonal, beside, taut, held, choices, velocities_out, numbers_work, active_work
):
    # in: one chain and its matrix   in/out: velocities_out: no taut rope lengthens after it, no held one shortens
    count = diagonal.shape[0]
    wanted, upper, impulses = numbers_work[0, :count], numbers_work[1, :count], numbers_work[2, :count]
    impulse_demand(directions, velocities_out, wanted)
    for i in range(impulses.shape[0]):
        impulses[i] = 0.0
    if choices[IMPULSE_SWEEPS] > 0:
        solve_sweeps(diagonal, beside, wanted, taut, held, choices[IMPULSE_SWEEPS], 0.0, impulses)
    else:
        solve_direct(diagonal, beside, wanted, taut, held, impulses, active_work, upper)
    pull(directions, inverse_masses, impulses, 1.0, velocities_out)


@kernel
def turn_about(x, y, z, vx, vy, vz, time, length):
    # in: offset (x, y, z) from the centre, velocity, time   returns: the offset turned on the sphere of radius length
    size = math.sqrt(x * x + y * y + z * z)
    x, y, z = x / size, y / size, z / size
    along = vx * x + vy * y + vz * z
    tx, ty, tz = vx - along * x, vy - along * y, vz - along * z
    speed = math.sqrt(tx * tx + ty * ty + tz * tz)
    if speed < 1e-14:
        return length * x, length * y, length * z
    angle = speed * time / length
    cosine, sine = length * math.cos(angle), length * math.sin(angle) / speed
    return cosine * x + sine * tx, cosine * y + sine * ty, cosine * z + sine * tz


@kernel
def move_node(i, length, held, h, starts, velocities, positions_out):
    # in: node i, its rope, starts (nodes, 3), velocities at the half step
    # in/out: positions_out, where i - 1 is already   (Eq. 10 to 13, in the frame of the node above: see dynamics.py)
    x, y, z = starts[i, 0] - starts[i - 1, 0], starts[i, 1] - starts[i - 1, 1], starts[i, 2] - starts[i - 1, 2]
    vx, vy, vz = velocities[i, 0], velocities[i, 1], velocities[i, 2]
    left = h
    if held:
        vx, vy, vz = vx - velocities[i - 1, 0], vy - velocities[i - 1, 1], vz - velocities[i - 1, 2]
    else:
        vx -= (positions_out[i - 1, 0] - starts[i - 1, 0]) / h
        vy -= (positions_out[i - 1, 1] - starts[i - 1, 1]) / h
        vz -= (positions_out[i - 1, 2] - starts[i - 1, 2]) / h
        a = vx * vx + vy * vy + vz * vz
        b = vx * x + vy * y + vz * z
        c = x * x + y * y + z * z - length * length
        if a * h * h + 2.0 * b * h + c <= 0.0:
            positions_out[i, 0] = positions_out[i - 1, 0] + x + h * vx
            positions_out[i, 1] = positions_out[i - 1, 1] + y + h * vy
            positions_out[i, 2] = positions_out[i - 1, 2] + z + h * vz
            return
        root = 0.0
        if a > 0.0 and b * b - a * c >= 0.0:
            far = (-b + math.sqrt(b * b - a * c)) / a
            near = (-b - math.sqrt(b * b - a * c)) / a
            root = far if 0.0 <= far <= h else (near if 0.0 <= near <= h else 0.0)
        x, y, z = x + root * vx, y + root * vy, z + root * vz
        left -= root
    if x * x + y * y + z * z < 1e-24:
        x, y, z = 0.0, -1.0, 0.0
    x, y, z = turn_about(x, y, z, vx, vy, vz, left, length)
    positions_out[i, 0] = positions_out[i - 1, 0] + x
    positions_out[i, 1] = positions_out[i - 1, 1] + y
    positions_out[i, 2] = positions_out[i - 1, 2] + z


@kernel
def turn_chains(chain_joints, frames, chain_frames_out):
    for c in range(chain_joints.shape[0]):
        for a in range(3):
            for b in range(3):
                chain_frames_out[c, a, b] = frames[chain_joints[c], a, b]


@kernel
def limit_speeds(offsets, velocities_out):
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
                share = SPEED_LIMIT / speed
                velocities_out[i, 0] = velocities_out[r, 0] + share * x
                velocities_out[i, 1] = velocities_out[r, 1] + share * y
                velocities_out[i, 2] = velocities_out[r, 2] + share * z


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
    # model: chains (offsets, lengths, rest state, masses, lateral pairs), numbers and choices, primitives
    # in: motion of the kinematic nodes, frames of the joints at both ends of the frame, push (nodes, 3), dt, substeps
    # in/out: positions_out, velocities_out (nodes, 3), tensions_out (nodes,)   out: touched_out (nodes,)
    nodes, chains, h = positions_out.shape[0], offsets.shape[0] - 1, dt / steps
    springs, accelerations = np.zeros((nodes, 3)), np.zeros((nodes, 3))
    starts, ends, directions = np.zeros((nodes, 3)), np.zeros((nodes, 3)), np.zeros((nodes, 3))
    system, taut, held = np.zeros((3, nodes)), np.zeros(nodes, np.bool_), np.zeros(nodes, np.bool_)
    numbers_work, flags_work = np.zeros((3, nodes)), np.zeros((2, nodes), np.bool_)
    chain_frames, root_velocities = np.zeros((chains, 3, 3)), np.zeros((chains, 3))
    before, after = frames_from.copy(), frames_from.copy()
    placed = np.zeros((PLACED, kinds.shape[0]))
    position_way, velocity_way = float(choices[POSITION]), float(choices[VELOCITY])
    place_primitives(kinds, joints, shapes, centres, before, before, placed)
    place_kinematic(kinematic, motion, dt, 0.0, positions_out, velocities_out)
    turn_chains(chain_joints, before, chain_frames)
    read_geometry(offsets, lengths, inverse_masses, positions_out, directions, system, taut)
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
        push,
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
        external_accelerations(offsets, across, numbers, h, springs, starts, velocities_out, accelerations)
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
                move_node(i, lengths[i], held[i], h, starts, velocities_out, positions_out)
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
            read_geometry(offsets[c : c + 2], lengths, inverse_masses, positions_out, directions, system, taut)
            if hit:
                for i in range(b - a):
                    flags_work[1, i] = False
                apply_impulses(
                    directions[a:b],
                    inverse_masses[a:b],
                    system[1, a:b],
                    system[2, a:b],
                    taut[a:b],
                    flags_work[1, : b - a],
                    choices,
                    velocities_out[a:b],
                    numbers_work,
                    flags_work[0, : b - a],
                )
        turn_chains(chain_joints, after, chain_frames)
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
            push,
            positions_out,
            springs,
        )
        external_accelerations(offsets, across, numbers, h, springs, positions_out, velocities_out, accelerations)
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
