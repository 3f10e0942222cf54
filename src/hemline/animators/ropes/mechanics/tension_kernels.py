"""The tridiagonal inequalities of one rope chain: tensions (Eq. 5) and impulses (Eq. 9), compiled.

Both ask for the smallest values x >= 0 with A x >= b on the taut ropes, where A is the symmetric tridiagonal matrix
`diagonal`, `beside` (`beside[i]` couples rope i and i + 1). Row 0 belongs to the root and is not used.
"""

import math

from hemline.compiled import kernel


@kernel
def solve_active(diagonal, beside, wanted, active, values_out, upper_work):
    # in: rows 1..m of the system, active (m + 1,)   out: values_out, 0 where not active
    previous = 0.0
    last = diagonal.shape[0] - 1
    for i in range(1, last + 1):
        if not active[i]:
            values_out[i], previous = 0.0, 0.0
            upper_work[i] = 0.0
            continue
        coupled = i > 1 and active[i - 1]
        side = beside[i - 1] if coupled else 0.0
        pivot = diagonal[i] - side * (upper_work[i - 1] if coupled else 0.0)
        upper_work[i] = beside[i] / pivot if i < last and active[i + 1] else 0.0
        values_out[i] = (wanted[i] - side * previous) / pivot
        previous = values_out[i]
    for i in range(last - 1, 0, -1):
        if active[i]:
            values_out[i] -= upper_work[i] * values_out[i + 1]


@kernel
def solve_direct(diagonal, beside, wanted, taut, held, values_out, active_work, upper_work):
    # in: the system; taut (m + 1,) ropes that may pull; held (m + 1,) ropes whose value has no sign
    # in/out: values_out (m + 1,), from whose positive ones the search starts   returns: systems solved
    # Block principal pivoting with Murty's single pivot as a way out: finite for any positive definite matrix.
    last = diagonal.shape[0] - 1
    scale, idle = 0.0, True
    for i in range(1, last + 1):
        active_work[i] = taut[i] and (held[i] or wanted[i] > 0.0 or values_out[i] > 0.0)
        scale = max(scale, abs(wanted[i]))
        idle = idle and not active_work[i]
    if idle:
        # no rope asks for anything: all values are zero
        for i in range(1, last + 1):
            values_out[i] = 0.0
        return 0
    slack = 1e-13 * scale
    best, patience, rounds = last + 1, 3, 0
    while rounds < 4 * last + 20:
        rounds += 1
        solve_active(diagonal, beside, wanted, active_work, values_out, upper_work)
        wrong, furthest = 0, 0
        for i in range(1, last + 1):
            if not taut[i] or held[i]:
                continue
            bad = values_out[i] * diagonal[i] < -slack
            if not active_work[i]:
                there = beside[i - 1] * values_out[i - 1] if i > 1 else 0.0
                there += beside[i] * values_out[i + 1] if i < last else 0.0
                bad = wanted[i] - there > slack
            if bad:
                wrong += 1
                furthest = i
                upper_work[i] = 1e300
        if wrong == 0:
            break
        single = wrong >= best
        if wrong < best:
            best, patience = wrong, 3
        elif patience > 0:
            patience -= 1
            single = False
        for i in range(1, last + 1):
            if upper_work[i] == 1e300 and (not single or i == furthest):
                active_work[i] = not active_work[i]
    for i in range(1, last + 1):
        if not held[i] and values_out[i] < 0.0:
            values_out[i] = 0.0
    return rounds


@kernel
def solve_sweeps(diagonal, beside, wanted, taut, held, sweeps, from_tip, values_out):
    # in: the system; sweeps; from_tip 1.0: tip to root (tensions), 0.0: root to tip (impulses)
    # in/out: values_out (m + 1,) starts from the last step's
    last = diagonal.shape[0] - 1
    for i in range(1, last + 1):
        if not taut[i]:
            values_out[i] = 0.0
    for _ in range(sweeps):
        for k in range(1, last + 1):
            i = last + 1 - k if from_tip > 0.0 else k
            if not taut[i]:
                continue
            value = wanted[i]
            if i > 1:
                value -= beside[i - 1] * values_out[i - 1]
            if i < last:
                value -= beside[i] * values_out[i + 1]
            value /= diagonal[i]
            values_out[i] = value if held[i] else max(0.0, value)


@kernel
def rope_directions(positions, lengths, slackness, directions_out, spans_out, slack_out, taut_out):
    # in: one chain's positions (m + 1, 3), lengths (m + 1,)
    # out: unit directions, spans, what the ropes lack of their lengths, taut flags
    taut_out[0] = False
    for i in range(1, positions.shape[0]):
        x = positions[i, 0] - positions[i - 1, 0]
        y = positions[i, 1] - positions[i - 1, 1]
        z = positions[i, 2] - positions[i - 1, 2]
        span = math.sqrt(x * x + y * y + z * z)
        spans_out[i], slack_out[i] = span, max(lengths[i] - span, 0.0)
        taut_out[i] = span >= lengths[i] * (1.0 - slackness)
        if span < 1e-12:
            directions_out[i, 0], directions_out[i, 1], directions_out[i, 2] = 0.0, -1.0, 0.0
        else:
            directions_out[i, 0], directions_out[i, 1], directions_out[i, 2] = x / span, y / span, z / span


@kernel
def rope_matrix(directions, inverse_masses, diagonal_out, beside_out):
    # in: directions (m + 1, 3), inverse_masses (m + 1,), 0 for the root
    # out: the matrix of Eq. 4 and 8 for accelerations
    last = directions.shape[0] - 1
    for i in range(1, last + 1):
        diagonal_out[i] = (inverse_masses[i - 1] if i > 1 else 0.0) + inverse_masses[i]
        beside_out[i] = 0.0
        if i < last:
            dot = (
                directions[i, 0] * directions[i + 1, 0]
                + directions[i, 1] * directions[i + 1, 1]
                + directions[i, 2] * directions[i + 1, 2]
            )
            beside_out[i] = -dot * inverse_masses[i]


@kernel
def tangent(angle):
    square = angle * angle
    if square < 0.01:
        return angle * (1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * 17.0 / 315.0)))
    return math.tan(angle)


@kernel
def tension_demand(directions, spans, slack, inverse_masses, tensions, velocities, accelerations, h, ahead, wanted_out):
    # in: one chain's directions, spans, slack, inverse_masses, velocities and external accelerations (m + 1, 3), the
    #     root's own in row 0; step h: the turn within it is followed exactly, slack is taken up within it, and a rope
    #     that slackens is only caught if it must be; 0: Eq. 1 and 4 as printed; the turn is that of the velocities a
    #     time `ahead`, to which accelerations and the neighbours' tensions (m + 1,) bring them
    # out: wanted_out (m + 1,): right-hand side of Eq. 4 as accelerations, centripetal part of Eq. 1 included
    last = directions.shape[0] - 1
    for i in range(1, last + 1):
        dx, dy, dz = directions[i, 0], directions[i, 1], directions[i, 2]
        ax = accelerations[i, 0] - accelerations[i - 1, 0]
        ay = accelerations[i, 1] - accelerations[i - 1, 1]
        az = accelerations[i, 2] - accelerations[i - 1, 2]
        vx = velocities[i, 0] - velocities[i - 1, 0]
        vy = velocities[i, 1] - velocities[i - 1, 1]
        vz = velocities[i, 2] - velocities[i - 1, 2]
        away = vx * dx + vy * dy + vz * dz - (slack[i] / h if h > 0.0 else 0.0)
        pulled = ax * dx + ay * dy + az * dz
        radius = max(spans[i], 1e-9)
        if h == 0.0:
            wanted_out[i] = pulled + max(vx * vx + vy * vy + vz * vz - away * away, 0.0) / radius
            continue
        if i > 1:
            above = inverse_masses[i - 1] * tensions[i - 1]
            ax += above * directions[i - 1, 0]
            ay += above * directions[i - 1, 1]
            az += above * directions[i - 1, 2]
        if i < last:
            below = inverse_masses[i] * tensions[i + 1]
            ax += below * directions[i + 1, 0]
            ay += below * directions[i + 1, 1]
            az += below * directions[i + 1, 2]
        vx, vy, vz = vx + ahead * ax, vy + ahead * ay, vz + ahead * az
        along = vx * dx + vy * dy + vz * dz
        speed = math.sqrt(max(vx * vx + vy * vy + vz * vz - along * along, 0.0))
        turn = 2.0 / h * speed * tangent(min(0.5 * h * speed / radius, 0.8))
        wanted_out[i] = pulled + turn + 2.0 / h * min(away, 0.0)


@kernel
def impulse_demand(directions, slack, velocities, h, wanted_out):
    # in: directions and velocities (m + 1, 3), slack (m + 1,), step h
    # out: wanted_out (m + 1,): how fast each rope lengthens (Eq. 7), beyond what takes up its slack within the step
    for i in range(1, directions.shape[0]):
        wanted_out[i] = (
            (velocities[i, 0] - velocities[i - 1, 0]) * directions[i, 0]
            + (velocities[i, 1] - velocities[i - 1, 1]) * directions[i, 1]
            + (velocities[i, 2] - velocities[i - 1, 2]) * directions[i, 2]
            - slack[i] / h
        )


@kernel
def pull(directions, inverse_masses, values, time, velocities_out):
    # in: values (m + 1,): tensions over `time`, or impulses with time 1   out: velocities_out changed by Eq. 2 or 6
    last = directions.shape[0] - 1
    for i in range(1, last + 1):
        share = time * inverse_masses[i]
        for d in range(3):
            force = -values[i] * directions[i, d]
            if i < last:
                force += values[i + 1] * directions[i + 1, d]
            velocities_out[i, d] += share * force
