"""External accelerations of the rope nodes, compiled: paper section 4 and a user's own forces.

Every spring constant is a relative acceleration per metre [1/s^2] and saturates as k / (1 + k h^2 / bound), so that no
constant, however large, makes central differencing unstable. Drag and damping act as 1 - exp(-k h / 2) in a half step.

Arguments that several kernels read: numbers (18,), the constants by the indices below; h, the substep [s];
chain_rotations (chains, 3, 3), rest to world at the root of each chain.
"""

import math

from hemline.compiled import kernel

from .balance import STANDARD_GRAVITY
from .kernel_inputs import Chains

GRAVITY, WIND = 0, 3
DRAG, AIR_DRAG, AIR_LIFT, LATERAL, LATERAL_STRETCH, SHRINK = 6, 7, 8, 9, 10, 11
PARENT_DAMPING, REST_ANGLE, BEND_DAMPING, LATERAL_DAMPING, ROOT_DAMPING = 12, 13, 14, 15, 16
BALANCE_REACH = 17

LATERAL_BOUND, SHRINK_BOUND, REST_ANGLE_BOUND = 0.4, 0.3, 0.1
"""Largest k h^2 of each kind of spring. With the tension of a rope at its substep, the sum of all modes is below 4."""


@kernel
def saturate(constant, h, bound):
    """Limits a spring constant to what a substep can follow.

    Reads: constant [1/s^2]; h [s]; bound: the largest k h^2 [1].
    Returns: k / (1 + k h^2 / bound) [1/s^2].
    """
    return constant / (1.0 + constant * h * h / bound)


@kernel
def add_spring(a, b, relative, inverse_masses, accelerations_out, x, y, z):
    """Adds the accelerations of a spring, divided between its ends by their masses.

    Reads: nodes a and b; relative: the acceleration of b relative to a per metre [1/s^2]; inverse_masses (nodes,)
        [1/kg]; x, y, z: from a to b [m].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    total = inverse_masses[a] + inverse_masses[b]
    if total > 0.0:
        first, second = -relative * inverse_masses[a] / total, relative * inverse_masses[b] / total
        accelerations_out[a, 0] += first * x
        accelerations_out[a, 1] += first * y
        accelerations_out[a, 2] += first * z
        accelerations_out[b, 0] += second * x
        accelerations_out[b, 1] += second * y
        accelerations_out[b, 2] += second * z


@kernel
def add_lateral(chains: Chains, numbers, h, positions, accelerations_out):
    """Adds the springs between neighbouring chains.

    Reads: chains; numbers; h; positions (nodes, 3) [m].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    pairs, pair_spans, inverse_masses = chains.pairs, chains.pair_spans, chains.inverse_masses
    soft = saturate(numbers[LATERAL], h, LATERAL_BOUND)
    stiff = saturate(numbers[LATERAL] + numbers[LATERAL_STRETCH], h, LATERAL_BOUND) - soft
    for k in range(pairs.shape[0]):
        a, b = int(pairs[k, 0]), int(pairs[k, 1])
        x, y, z = (
            positions[b, 0] - positions[a, 0],
            positions[b, 1] - positions[a, 1],
            positions[b, 2] - positions[a, 2],
        )
        span = math.sqrt(x * x + y * y + z * z)
        if span > 1e-9:
            pull = soft * (pair_spans[k, 0] - span) + stiff * min(pair_spans[k, 1] - span, 0.0)
            add_spring(a, b, pull / span, inverse_masses, accelerations_out, x, y, z)


@kernel
def add_shrink(chains: Chains, numbers, h, positions, accelerations_out):
    """Adds the springs that keep ropes from getting shorter than at rest.

    Reads: chains; numbers; h; positions (nodes, 3) [m].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    offsets, rest_spans, inverse_masses = chains.offsets, chains.rest_spans, chains.inverse_masses
    constant = saturate(numbers[SHRINK], h, SHRINK_BOUND)
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            x = positions[i, 0] - positions[i - 1, 0]
            y = positions[i, 1] - positions[i - 1, 1]
            z = positions[i, 2] - positions[i - 1, 2]
            span = math.sqrt(x * x + y * y + z * z)
            if 1e-9 < span < rest_spans[i]:
                push = constant * (rest_spans[i] - span) / span
                add_spring(i - 1, i, push, inverse_masses, accelerations_out, x, y, z)


@kernel
def add_rest_angles(chains: Chains, numbers, h, chain_rotations, positions, accelerations_out):
    """Adds springs towards the rest angle of each rope to the one above, in a frame carried down without twist.

    Reads: chains; numbers; h; chain_rotations; positions (nodes, 3) [m].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    offsets, rest_directions, inverse_masses = chains.offsets, chains.rest_directions, chains.inverse_masses
    constant = saturate(numbers[REST_ANGLE], h, REST_ANGLE_BOUND)
    for c in range(offsets.shape[0] - 1):
        # a0..a2, b0..b2, c0..c2: rows of the carried frame
        a0, a1, a2 = chain_rotations[c, 0, 0], chain_rotations[c, 0, 1], chain_rotations[c, 0, 2]
        b0, b1, b2 = chain_rotations[c, 1, 0], chain_rotations[c, 1, 1], chain_rotations[c, 1, 2]
        c0, c1, c2 = chain_rotations[c, 2, 0], chain_rotations[c, 2, 1], chain_rotations[c, 2, 2]
        for i in range(offsets[c] + 1, offsets[c + 1]):
            x = positions[i, 0] - positions[i - 1, 0]
            y = positions[i, 1] - positions[i - 1, 1]
            z = positions[i, 2] - positions[i - 1, 2]
            span = math.sqrt(x * x + y * y + z * z)
            if span < 1e-9:
                continue
            rx, ry, rz = rest_directions[i, 0], rest_directions[i, 1], rest_directions[i, 2]
            tx, ty, tz = a0 * rx + a1 * ry + a2 * rz, b0 * rx + b1 * ry + b2 * rz, c0 * rx + c1 * ry + c2 * rz
            if i > offsets[c] + 1:
                add_spring(
                    i - 1, i, constant, inverse_masses, accelerations_out, span * tx - x, span * ty - y, span * tz - z
                )
            x, y, z = x / span, y / span, z / span
            dot = tx * x + ty * y + tz * z
            if dot > -0.99:
                # rotate the frame by the smallest rotation that takes t onto the rope: with w = t x l,
                # R += [w] R + [w]^2 R / (1 + dot)
                wx, wy, wz = ty * z - tz * y, tz * x - tx * z, tx * y - ty * x
                f = 1.0 / (1.0 + dot)
                p0, p1, p2 = dot + f * wx * wx, f * wx * wy - wz, f * wx * wz + wy
                q0, q1, q2 = f * wx * wy + wz, dot + f * wy * wy, f * wy * wz - wx
                r0, r1, r2 = f * wx * wz - wy, f * wy * wz + wx, dot + f * wz * wz
                a0, b0, c0 = p0 * a0 + p1 * b0 + p2 * c0, q0 * a0 + q1 * b0 + q2 * c0, r0 * a0 + r1 * b0 + r2 * c0
                a1, b1, c1 = p0 * a1 + p1 * b1 + p2 * c1, q0 * a1 + q1 * b1 + q2 * c1, r0 * a1 + r1 * b1 + r2 * c1
                a2, b2, c2 = p0 * a2 + p1 * b2 + p2 * c2, q0 * a2 + q1 * b2 + q2 * c2, r0 * a2 + r1 * b2 + r2 * c2


@kernel
def remaining_balance(reach, rotations, root, here, rest, balance):
    """Computes which fraction of its balance a node keeps: less, the farther it has moved along it off its support.

    Reads: reach: distance at which none is left [m]; rotations (3, 3): rest to world at the root of the chain; root,
        here (3,): positions of the root and of the node [m]; rest: x, y, z from the root to the node at rest [m];
        balance (3,): in the rest pose [m/s^2].
    Returns: 1 at rest and nearer to the support, 0 from `reach` off it.
    """
    size = math.sqrt(balance[0] * balance[0] + balance[1] * balance[1] + balance[2] * balance[2])
    if size < 1e-9:
        return 1.0
    away = 0.0
    for d in range(3):
        x, y, z = rotations[d, 0], rotations[d, 1], rotations[d, 2]
        at_rest = root[d] + x * rest[0] + y * rest[1] + z * rest[2]
        away += (here[d] - at_rest) * (x * balance[0] + y * balance[1] + z * balance[2]) / size
    return min(1.0, max(0.0, 1.0 - away / reach))


@kernel
def add_balance(chains: Chains, numbers, chain_rotations, tensions, positions, accelerations_out):
    """Adds the balance, which is proportional to the load of a node and never larger than at rest.

    It stands for the support of the cloth, so it fades where a node has moved off it (`remaining_balance`).

    Reads: chains; numbers; chain_rotations; tensions (nodes,) [N]; positions (nodes, 3) [m].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    offsets, balance, spans, directions = chains.offsets, chains.balance, chains.rest_spans, chains.rest_directions
    rest_loads, inverse_masses = chains.rest_loads, chains.inverse_masses
    x, y, z = numbers[GRAVITY], numbers[GRAVITY + 1], numbers[GRAVITY + 2]
    gravity, reach = math.sqrt(x * x + y * y + z * z), numbers[BALANCE_REACH]
    for c in range(offsets.shape[0] - 1):
        root, rest_x, rest_y, rest_z = offsets[c], 0.0, 0.0, 0.0
        for i in range(offsets[c] + 1, offsets[c + 1]):
            load = gravity / inverse_masses[i]
            if i + 1 < offsets[c + 1]:
                load += tensions[i + 1]
            ratio = min(load / rest_loads[i], gravity / STANDARD_GRAVITY)
            if reach > 0.0:
                rest_x += spans[i] * directions[i, 0]
                rest_y += spans[i] * directions[i, 1]
                rest_z += spans[i] * directions[i, 2]
                rest = (rest_x, rest_y, rest_z)
                ratio *= remaining_balance(reach, chain_rotations[c], positions[root], positions[i], rest, balance[i])
            x, y, z = ratio * balance[i, 0], ratio * balance[i, 1], ratio * balance[i, 2]
            for d in range(3):
                rotated = chain_rotations[c, d, 0] * x + chain_rotations[c, d, 1] * y + chain_rotations[c, d, 2] * z
                accelerations_out[i, d] += rotated


@kernel
def spring_accelerations(chains: Chains, numbers, h, chain_rotations, push, tensions, positions, accelerations_out):
    """Computes the accelerations that do not depend on velocities: gravity, push, balance, springs.

    Reads: chains; numbers; h; chain_rotations; push (nodes, 3): a user's accelerations [m/s^2]; tensions (nodes,) [N];
        positions (nodes, 3) [m].
    Writes: accelerations_out (nodes, 3) [m/s^2].
    """
    for i in range(positions.shape[0]):
        for d in range(3):
            accelerations_out[i, d] = numbers[GRAVITY + d] + push[i, d]
    add_balance(chains, numbers, chain_rotations, tensions, positions, accelerations_out)
    if numbers[LATERAL] > 0.0 or numbers[LATERAL_STRETCH] > 0.0:
        add_lateral(chains, numbers, h, positions, accelerations_out)
    if numbers[SHRINK] > 0.0:
        add_shrink(chains, numbers, h, positions, accelerations_out)
    if numbers[REST_ANGLE] > 0.0:
        add_rest_angles(chains, numbers, h, chain_rotations, positions, accelerations_out)


@kernel
def add_air(chains: Chains, numbers, h, positions, velocities, accelerations_out):
    """Adds drag and lift of cloth that faces the air, which the simulator has too (`air_kernels.air_by_triangle`).

    With u = wind - v and n the cloth's normal: a = |u.n| (drag - lift |u.n| / |u|) u + lift |u| (u.n) n, with each rate
    r bounded as r / (1 + r h / 2).

    Reads: chains; numbers; h; positions (nodes, 3) [m]; velocities (nodes, 3) [m/s].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    offsets, across = chains.offsets, chains.across
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            below, left, right = min(i + 1, offsets[c + 1] - 1), across[i, 0], across[i, 1]
            ax, ay, az = (
                positions[below, 0] - positions[i - 1, 0],
                positions[below, 1] - positions[i - 1, 1],
                positions[below, 2] - positions[i - 1, 2],
            )
            bx, by, bz = (
                positions[right, 0] - positions[left, 0],
                positions[right, 1] - positions[left, 1],
                positions[right, 2] - positions[left, 2],
            )
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            size = math.sqrt(nx * nx + ny * ny + nz * nz)
            x, y, z = (
                numbers[WIND] - velocities[i, 0],
                numbers[WIND + 1] - velocities[i, 1],
                numbers[WIND + 2] - velocities[i, 2],
            )
            speed = math.sqrt(x * x + y * y + z * z)
            if size < 1e-12 or speed < 1e-12:
                continue
            nx, ny, nz = nx / size, ny / size, nz / size
            facing = x * nx + y * ny + z * nz
            plain = abs(facing) * max(numbers[AIR_DRAG] - numbers[AIR_LIFT] * abs(facing) / speed, 0.0)
            lifted = numbers[AIR_LIFT] * speed
            ratio = 1.0 / (1.0 + 0.5 * h * (plain + lifted))
            plain, lifted = ratio * plain, ratio * lifted * facing
            accelerations_out[i, 0] += plain * x + lifted * nx
            accelerations_out[i, 1] += plain * y + lifted * ny
            accelerations_out[i, 2] += plain * z + lifted * nz


@kernel
def smooth_node(i, a, b, rate, inverse_masses, velocities, accelerations_out):
    """Adds the smoothing of one node's velocity, which keeps the momentum of the three nodes.

    Reads: node i between nodes a and b; rate at which it takes on their mean velocity [1/s]; inverse_masses (nodes,)
        [1/kg]; velocities (nodes, 3) [m/s].
    Writes: accelerations_out (nodes, 3): changed at i, a and b [m/s^2].
    """
    for d in range(3):
        away = rate * (velocities[i, d] - 0.5 * (velocities[a, d] + velocities[b, d]))
        accelerations_out[i, d] -= away
        accelerations_out[a, d] += 0.5 * away * inverse_masses[a] / inverse_masses[i]
        accelerations_out[b, d] += 0.5 * away * inverse_masses[b] / inverse_masses[i]


@kernel
def add_smoothing(chains: Chains, numbers, h, velocities, accelerations_out):
    """Adds the smoothing of velocities along the chains and across them.

    A node takes on the mean velocity of the nodes above and below it, and of those to both sides, at rates bounded so
    that half a step brings none beyond it. A turning chain is left alone.

    Reads: chains; numbers; h; velocities (nodes, 3) [m/s].
    Writes: accelerations_out (nodes, 3): changed [m/s^2].
    """
    offsets, across, inverse_masses = chains.offsets, chains.across, chains.inverse_masses
    down = numbers[BEND_DAMPING] / (1.0 + 4.0 * h * numbers[BEND_DAMPING])
    side = numbers[LATERAL_DAMPING] / (1.0 + 4.0 * h * numbers[LATERAL_DAMPING])
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            if i + 1 < offsets[c + 1]:
                smooth_node(i, i - 1, i + 1, down, inverse_masses, velocities, accelerations_out)
            if across[i, 0] != i and across[i, 1] != i:
                smooth_node(i, across[i, 0], across[i, 1], side, inverse_masses, velocities, accelerations_out)


@kernel
def external_accelerations(chains: Chains, numbers, h, springs, positions, velocities, accelerations_out):
    """Computes all external accelerations: springs, drag, damping, and drag and lift of cloth that faces the air.

    Drag takes a node towards the velocity of the wind, whichever way the cloth faces. Damping takes it towards the
    velocity of the node above, faster near the root, and of the nodes around. `add_air` handles the cloth's facing.

    Reads: chains; numbers; h; springs (nodes, 3) of `spring_accelerations` [m/s^2]; positions (nodes, 3) [m];
        velocities (nodes, 3) [m/s].
    Writes: accelerations_out (nodes, 3) [m/s^2].
    """
    offsets = chains.offsets
    drag = numbers[DRAG]
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            damping = numbers[PARENT_DAMPING] + numbers[ROOT_DAMPING] * math.exp(offsets[c] + 1.0 - i)
            rate = (1.0 - math.exp(-0.5 * h * (drag + damping))) / (0.5 * h)
            wind_weight = drag / (drag + damping) if drag + damping > 0.0 else 0.0
            for d in range(3):
                towards = wind_weight * numbers[WIND + d] + (1.0 - wind_weight) * velocities[i - 1, d]
                accelerations_out[i, d] = springs[i, d] + rate * (towards - velocities[i, d])
    if numbers[BEND_DAMPING] > 0.0 or numbers[LATERAL_DAMPING] > 0.0:
        add_smoothing(chains, numbers, h, velocities, accelerations_out)
    if numbers[AIR_DRAG] > 0.0 or numbers[AIR_LIFT] > 0.0:
        add_air(chains, numbers, h, positions, velocities, accelerations_out)
