"""Motion of the body before ropes move: where it carries the kinematic nodes, and how far the key joint moves."""

from hemline.compiled import kernel


@kernel
def carry_nodes(weights, rest, frames, positions_out):
    """Carries points by linear blend skinning.

    Reads: weights (kin, joints); rest (kin, 3) [m]; frames (joints, 3, 4).
    Writes: positions_out (kin, 3) [m].
    """
    for k in range(rest.shape[0]):
        for a in range(3):
            value = 0.0
            for j in range(weights.shape[1]):
                if weights[k, j] != 0.0:
                    value += weights[k, j] * (
                        frames[j, a, 0] * rest[k, 0]
                        + frames[j, a, 1] * rest[k, 1]
                        + frames[j, a, 2] * rest[k, 2]
                        + frames[j, a, 3]
                    )
            positions_out[k, a] = value


@kernel
def squared_displacement(frames_from, frames_to, j, pivots):
    """Measures how far a joint moved between two poses.

    Reads: frames_from, frames_to (joints, 3, 4); joint j; pivots (joints, 3): joints at rest [m].
    Returns: the squared distance [m^2].
    """
    total = 0.0
    for a in range(3):
        displacement = frames_to[j, a, 3] - frames_from[j, a, 3]
        for b in range(3):
            displacement += (frames_to[j, a, b] - frames_from[j, a, b]) * pivots[j, b]
        total += displacement * displacement
    return total


@kernel
def kinematic_motion(kinematic, positions, velocities, rates, last_dt, dt, motion_out):
    """Completes the motion of the kinematic nodes over a step.

    The velocity at the end is extrapolated from the mean velocities of this step and the last one, so that a uniformly
    accelerated node moves exactly so in all substeps.

    Reads: kinematic (kin,); positions (nodes, 3) [m]; velocities at the end of the last step and mean rates over it
        (kin, 3) [m/s]; last_dt: its length, 0 without history [s]; dt [s]; motion_out[1]: positions at the end [m].
    Writes: motion_out (4, kin, 3): positions at both ends [m], then velocities at both ends [m/s].
    """
    for k in range(kinematic.shape[0]):
        for d in range(3):
            start = positions[kinematic[k], d]
            rate = (motion_out[1, k, d] - start) / dt
            motion_out[0, k, d] = start
            motion_out[2, k, d] = velocities[k, d] if last_dt > 0.0 else rate
            motion_out[3, k, d] = rate + (rate - rates[k, d]) * dt / (dt + last_dt) if last_dt > 0.0 else rate
