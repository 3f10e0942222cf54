"""The tridiagonal inequalities of one rope chain: tensions (Eq. 5) and impulses (Eq. 9), compiled.

Both are the smallest values x >= 0 with A x >= b on the taut ropes. A is the symmetric tridiagonal matrix of
`diagonal` and `beside` (`beside[i]` couples rope i to rope i + 1). Row 0 belongs to the root and is not used.
"""

import math

from hemline.compiled import kernel

from .kernel_inputs import RopeGeometry


@kernel
def solve_active(diagonal, beside, wanted, active, values_out, upper_work):
    """Solves the rows of the active ropes as equations, by elimination.

    Reads: diagonal, beside (m + 1,): the matrix; wanted (m + 1,): the right-hand side; active (m + 1,): ropes to solve
        for. Entry 0 of each belongs to the root and is not used.
    Writes: values_out (m + 1,): 0 where not active; upper_work (m + 1,).
    """
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
def solve_direct(diagonal, beside, wanted, taut, signless, values_out, active_work, upper_work):
    """Solves the inequalities by block principal pivoting.

    Murty's single pivot is the fallback, which makes the search finite for any positive definite matrix.

    Reads: diagonal, beside, wanted (m + 1,): the system; taut (m + 1,): ropes that may pull; signless (m + 1,): ropes
        whose value may be negative; values_out (m + 1,): the search starts from its positive values.
    Writes: values_out (m + 1,); active_work, upper_work (m + 1,).
    Returns: the number of systems solved.
    """
    last = diagonal.shape[0] - 1
    scale, idle = 0.0, True
    for i in range(1, last + 1):
        active_work[i] = taut[i] and (signless[i] or wanted[i] > 0.0 or values_out[i] > 0.0)
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
            if not taut[i] or signless[i]:
                continue
            bad = values_out[i] * diagonal[i] < -slack
            if not active_work[i]:
                given = beside[i - 1] * values_out[i - 1] if i > 1 else 0.0
                given += beside[i] * values_out[i + 1] if i < last else 0.0
                bad = wanted[i] - given > slack
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
        if not signless[i] and values_out[i] < 0.0:
            values_out[i] = 0.0
    return rounds


@kernel
def solve_sweeps(diagonal, beside, wanted, taut, signless, sweeps, from_tip, values_out):
    """Solves the inequalities approximately by Gauss-Seidel sweeps.

    Reads: diagonal, beside, wanted, taut, signless (m + 1,), as `solve_direct`; sweeps: their number; from_tip: 1.0
        for tip to root (tensions), 0.0 for root to tip (impulses); values_out (m + 1,): the first guess.
    Writes: values_out (m + 1,).
    """
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
            values_out[i] = value if signless[i] else max(0.0, value)


@kernel
def rope_directions(positions, lengths, tolerance, directions_out, spans_out, slack_out, taut_out):
    """Measures the ropes of one chain.

    Reads: positions (m + 1, 3) [m]; lengths (m + 1,) [m]; tolerance: a rope is taut whose span is at least
        (1 - tolerance) of its length [1].
    Writes: directions_out (m + 1, 3): unit vectors; spans_out, slack_out (m + 1,): spans, and what they lack of the
        lengths [m]; taut_out (m + 1,).
    """
    taut_out[0] = False
    for i in range(1, positions.shape[0]):
        x = positions[i, 0] - positions[i - 1, 0]
        y = positions[i, 1] - positions[i - 1, 1]
        z = positions[i, 2] - positions[i - 1, 2]
        span = math.sqrt(x * x + y * y + z * z)
        spans_out[i], slack_out[i] = span, max(lengths[i] - span, 0.0)
        taut_out[i] = span >= lengths[i] * (1.0 - tolerance)
        if span < 1e-12:
            directions_out[i, 0], directions_out[i, 1], directions_out[i, 2] = 0.0, -1.0, 0.0
        else:
            directions_out[i, 0], directions_out[i, 1], directions_out[i, 2] = x / span, y / span, z / span


@kernel
def rope_matrix(directions, inverse_masses, diagonal_out, beside_out):
    """Assembles the matrix of Eq. 4 and 8 for accelerations.

    Reads: directions (m + 1, 3); inverse_masses (m + 1,), 0 for the root [1/kg].
    Writes: diagonal_out, beside_out (m + 1,) [1/kg].
    """
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
    """Computes the tangent; a series for small angles, which is faster.

    Reads: angle [rad].
    Returns: its tangent.
    """
    square = angle * angle
    if square < 0.01:
        return angle * (1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * 17.0 / 315.0)))
    return math.tan(angle)


@kernel(inline="always")
def tension_demand(ropes: RopeGeometry, inverse_masses, tensions, velocities, accelerations, h, ahead, wanted_out):
    """Assembles the right-hand side of Eq. 4 as accelerations, with the centripetal part of Eq. 1.

    A step h > 0 follows the turn within it exactly, takes slack up within it, and catches a rope that slackens only as
    far as it must; h = 0 gives Eq. 1 and 4 as printed. The turn is that of the velocities a time `ahead` later, to
    which the accelerations and the tensions of the neighbouring ropes bring them.

    Reads: ropes of one chain; inverse_masses (m + 1,) [1/kg]; tensions (m + 1,) [N]; velocities (m + 1, 3) [m/s];
        accelerations (m + 1, 3): external ones, the root's own in row 0 [m/s^2]; h, ahead [s].
    Writes: wanted_out (m + 1,) [m/s^2].
    """
    directions, spans, slack = ropes.directions, ropes.spans, ropes.slack
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
    """Computes how fast each rope lengthens (Eq. 7), beyond what takes up its slack within the step.

    Reads: directions (m + 1, 3); slack (m + 1,) [m]; velocities (m + 1, 3) [m/s]; h: step [s].
    Writes: wanted_out (m + 1,) [m/s].
    """
    for i in range(1, directions.shape[0]):
        wanted_out[i] = (
            (velocities[i, 0] - velocities[i - 1, 0]) * directions[i, 0]
            + (velocities[i, 1] - velocities[i - 1, 1]) * directions[i, 1]
            + (velocities[i, 2] - velocities[i - 1, 2]) * directions[i, 2]
            - slack[i] / h
        )


@kernel
def apply_tensions(directions, inverse_masses, values, time, velocities_out):
    """Changes velocities by tensions (Eq. 2) or impulses (Eq. 6).

    Reads: directions (m + 1, 3); inverse_masses (m + 1,) [1/kg]; values (m + 1,): tensions [N] that act for time [s],
        or impulses [N s] with time 1.
    Writes: velocities_out (m + 1, 3): changed [m/s].
    """
    last = directions.shape[0] - 1
    for i in range(1, last + 1):
        mobility = time * inverse_masses[i]
        for d in range(3):
            force = -values[i] * directions[i, d]
            if i < last:
                force += values[i + 1] * directions[i + 1, d]
            velocities_out[i, d] += mobility * force
