"""What a step needs of the body before ropes move: where it carries the kinematic nodes, and whether it jumped."""

from hemline.compiled import kernel


@kernel
def carry_nodes(weights, rest, frames, positions_out):
    # model: weights (kin, joints), rest (kin, 3)   in: frames (joints, 3, 4)   out: positions_out (kin, 3)
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
def squared_jump(frames_from, frames_to, j, pivots):
    # in: two poses   returns: squared distance that joint j moved between them
    total = 0.0
    for a in range(3):
        way = frames_to[j, a, 3] - frames_from[j, a, 3]
        for b in range(3):
            way += (frames_to[j, a, b] - frames_from[j, a, b]) * pivots[j, b]
        total += way * way
    return total


@kernel
def kinematic_motion(kinematic, positions, velocities, rates, last_dt, dt, motion_out):
    # in: kinematic (kin,), positions (nodes, 3), velocities and mean rates (kin, 3) of the last step (last_dt; 0: none)
    # in/out: motion_out (4, kin, 3): positions at both ends (the second is given), velocities at both ends
    # The velocity at the end is extrapolated from the mean velocities of this step and the last one, so that a
    # uniformly accelerated node moves exactly so in all substeps.
    for k in range(kinematic.shape[0]):
        for d in range(3):
            start = positions[kinematic[k], d]
            rate = (motion_out[1, k, d] - start) / dt
            motion_out[0, k, d] = start
            motion_out[2, k, d] = velocities[k, d] if last_dt > 0.0 else rate
            motion_out[3, k, d] = rate + (rate - rates[k, d]) * dt / (dt + last_dt) if last_dt > 0.0 else rate
