"""External accelerations of the rope nodes, compiled: paper section 4 and what a user adds.

Every spring constant is a relative acceleration per metre [1/s^2] and saturates as k / (1 + k h^2 / bound), so that no
constant, however large, makes central differencing unstable; drag and damping act as 1 - exp(-k h / 2) of a half step.
"""

import math

from hemline.compiled import kernel

from .balance import STANDARD_GRAVITY

GRAVITY, WIND = 0, 3
DRAG, AIR_DRAG, AIR_LIFT, LATERAL, LATERAL_STRETCH, SHRINK = 6, 7, 8, 9, 10, 11
PARENT_DAMPING, REST_ANGLE, FRICTION, MARGIN = 12, 13, 14, 15
BEND_DAMPING, LATERAL_DAMPING, ROOT_DAMPING = 16, 17, 18

LATERAL_BOUND, SHRINK_BOUND, REST_ANGLE_BOUND = 0.4, 0.3, 0.1
"""Largest k h^2 of each kind: with the tension of a rope at its substep, the sum of all modes stays below 4."""


@kernel
def saturate(constant, h, bound):
    return constant / (1.0 + constant * h * h / bound)


@kernel
def add_spring(a, b, relative, inverse_masses, accelerations_out, x, y, z):
    # in: nodes a and b, their wished relative acceleration `relative` along (x, y, z), from a to b
    share = inverse_masses[a] + inverse_masses[b]
    if share > 0.0:
        first, second = -relative * inverse_masses[a] / share, relative * inverse_masses[b] / share
        accelerations_out[a, 0] += first * x
        accelerations_out[a, 1] += first * y
        accelerations_out[a, 2] += first * z
        accelerations_out[b, 0] += second * x
        accelerations_out[b, 1] += second * y
        accelerations_out[b, 2] += second * z


@kernel
def add_lateral(pairs, pair_spans, inverse_masses, numbers, h, positions, accelerations_out):
    # model: pairs (pairs, 2), pair_spans (pairs, 2): rest and longest distance   out: accelerations_out changed
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
def add_shrink(offsets, rest_spans, inverse_masses, numbers, h, positions, accelerations_out):
    # model: rest_spans (nodes,) length below which a rope resists shrinking   out: accelerations_out changed
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
def add_rest_angles(offsets, rest_directions, inverse_masses, numbers, h, chain_frames, positions, accelerations_out):
    # model: rest_directions (nodes, 3) of each rope at rest   in: chain_frames (chains, 3, 3) rest -> world at the root
    # out: accelerations_out changed. Each rope wants the rest angle to the one above, in a frame carried without twist.
    constant = saturate(numbers[REST_ANGLE], h, REST_ANGLE_BOUND)
    for c in range(offsets.shape[0] - 1):
        # a0..a2, b0..b2, c0..c2: rows of the carried frame
        a0, a1, a2 = chain_frames[c, 0, 0], chain_frames[c, 0, 1], chain_frames[c, 0, 2]
        b0, b1, b2 = chain_frames[c, 1, 0], chain_frames[c, 1, 1], chain_frames[c, 1, 2]
        c0, c1, c2 = chain_frames[c, 2, 0], chain_frames[c, 2, 1], chain_frames[c, 2, 2]
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
                # turn the frame by the smallest rotation that takes t onto the rope: with w = t x l,
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
def add_balance(offsets, balance, rest_loads, inverse_masses, numbers, chain_frames, tensions, accelerations_out):
    # model: balance (nodes, 3) at rest, rest_loads (nodes,) weight and pull from below there
    # in: chain_frames (chains, 3, 3) rest -> world at the root, tensions (nodes,)
    # out: accelerations_out changed. What held the cloth at rest yields with its load, and holds no more than at rest.
    x, y, z = numbers[GRAVITY], numbers[GRAVITY + 1], numbers[GRAVITY + 2]
    gravity = math.sqrt(x * x + y * y + z * z)
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            load = gravity / inverse_masses[i]
            if i + 1 < offsets[c + 1]:
                load += tensions[i + 1]
            share = min(load / rest_loads[i], gravity / STANDARD_GRAVITY)
            x, y, z = share * balance[i, 0], share * balance[i, 1], share * balance[i, 2]
            for d in range(3):
                turned = chain_frames[c, d, 0] * x + chain_frames[c, d, 1] * y + chain_frames[c, d, 2] * z
                accelerations_out[i, d] += turned


@kernel
def spring_accelerations(
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
    tensions,
    positions,
    accelerations_out,
):
    # model: chains, rest state, numbers, balance
    # in: substep h, chain_frames, push (nodes, 3), tensions (nodes,), positions
    # out: accelerations_out (nodes, 3) that do not depend on velocities: gravity, push, balance, springs
    for i in range(positions.shape[0]):
        for d in range(3):
            accelerations_out[i, d] = numbers[GRAVITY + d] + push[i, d]
    add_balance(offsets, balance, rest_loads, inverse_masses, numbers, chain_frames, tensions, accelerations_out)
    if numbers[LATERAL] > 0.0 or numbers[LATERAL_STRETCH] > 0.0:
        add_lateral(pairs, pair_spans, inverse_masses, numbers, h, positions, accelerations_out)
    if numbers[SHRINK] > 0.0:
        add_shrink(offsets, rest_spans, inverse_masses, numbers, h, positions, accelerations_out)
    if numbers[REST_ANGLE] > 0.0:
        add_rest_angles(
            offsets, rest_directions, inverse_masses, numbers, h, chain_frames, positions, accelerations_out
        )


@kernel
def add_air(offsets, across, numbers, h, positions, velocities, accelerations_out):
    # model: across (nodes, 2) the nodes to both sides   in: substep h, positions, velocities
    # out: accelerations_out changed by the air on cloth that faces it: with u = wind - v, n the cloth's normal,
    #     a = |u.n| (drag - lift |u.n| / |u|) u + lift |u| (u.n) n, each rate r bounded as r / (1 + r h / 2)
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
            share = 1.0 / (1.0 + 0.5 * h * (plain + lifted))
            plain, lifted = share * plain, share * lifted * facing
            accelerations_out[i, 0] += plain * x + lifted * nx
            accelerations_out[i, 1] += plain * y + lifted * ny
            accelerations_out[i, 2] += plain * z + lifted * nz


@kernel
def smooth_node(i, a, b, rate, inverse_masses, velocities, accelerations_out):
    # in: node i between nodes a and b, rate at which it takes on their mean velocity
    # out: accelerations_out of all three changed, their momentum kept
    for d in range(3):
        away = rate * (velocities[i, d] - 0.5 * (velocities[a, d] + velocities[b, d]))
        accelerations_out[i, d] -= away
        accelerations_out[a, d] += 0.5 * away * inverse_masses[a] / inverse_masses[i]
        accelerations_out[b, d] += 0.5 * away * inverse_masses[b] / inverse_masses[i]


@kernel
def add_smoothing(offsets, across, inverse_masses, numbers, h, velocities, accelerations_out):
    # out: accelerations_out changed: a node takes on the mean velocity of the nodes above and below it, and of those
    #     to both sides, at rates bounded so that half a step brings none beyond it; a turning chain is left alone
    down = numbers[BEND_DAMPING] / (1.0 + 4.0 * h * numbers[BEND_DAMPING])
    side = numbers[LATERAL_DAMPING] / (1.0 + 4.0 * h * numbers[LATERAL_DAMPING])
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            if i + 1 < offsets[c + 1]:
                smooth_node(i, i - 1, i + 1, down, inverse_masses, velocities, accelerations_out)
            if across[i, 0] != i and across[i, 1] != i:
                smooth_node(i, across[i, 0], across[i, 1], side, inverse_masses, velocities, accelerations_out)


@kernel
def external_accelerations(
    offsets, across, inverse_masses, numbers, h, springs, positions, velocities, accelerations_out
):
    # model: chains, across (nodes, 2), inverse_masses, numbers
    # in: substep h, springs (nodes, 3) from `spring_accelerations`, positions, velocities
    # out: accelerations_out (nodes, 3): with wind drag, air, and damping
    #     relative to the node above, harder below the root, and to the nodes around
    drag = numbers[DRAG]
    for c in range(offsets.shape[0] - 1):
        for i in range(offsets[c] + 1, offsets[c + 1]):
            damping = numbers[PARENT_DAMPING] + numbers[ROOT_DAMPING] * math.exp(offsets[c] + 1.0 - i)
            rate = (1.0 - math.exp(-0.5 * h * (drag + damping))) / (0.5 * h)
            wind_share = drag / (drag + damping) if drag + damping > 0.0 else 0.0
            for d in range(3):
                towards = wind_share * numbers[WIND + d] + (1.0 - wind_share) * velocities[i - 1, d]
                accelerations_out[i, d] = springs[i, d] + rate * (towards - velocities[i, d])
    if numbers[BEND_DAMPING] > 0.0 or numbers[LATERAL_DAMPING] > 0.0:
        add_smoothing(offsets, across, inverse_masses, numbers, h, velocities, accelerations_out)
    if numbers[AIR_DRAG] > 0.0 or numbers[AIR_LIFT] > 0.0:
        add_air(offsets, across, numbers, h, positions, velocities, accelerations_out)
