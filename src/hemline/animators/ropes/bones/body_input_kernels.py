"""The body's motion in one frame, compiled: `body_inputs.body_inputs` for one pose."""

from hemline.compiled import kernel


@kernel
def write_body_inputs(joints, key, input_joints, then, now, dt, wind, inputs_out):
    """Computes the inputs of the bone correction from the body.

    Reads: joints (joints, 3) at rest [m]; key: index of the key joint; input_joints (n,): `INPUT_JOINTS`; then, now
        (joints, 3, 4): the last pose and this one; dt: the time between them [s]; wind (3,) [m/s].
    Writes: inputs_out (6 + 3 n,), in the order of `body_inputs`.
    """
    for a in range(3):
        speed = 0.0
        for c in range(3):
            here, there = now[key, c, 3], then[key, c, 3]
            for d in range(3):
                here += now[key, c, d] * joints[key, d]
                there += then[key, c, d] * joints[key, d]
            speed += now[key, c, a] * ((here - there) / dt - wind[c])
        inputs_out[a] = -now[key, 1, a]
        inputs_out[3 + a] = speed
    for k in range(input_joints.shape[0]):
        j = input_joints[k]
        for a in range(3):
            inputs_out[6 + 3 * k + a] = -joints[j, a]
        for c in range(3):
            away = now[j, c, 3] - now[key, c, 3]
            for d in range(3):
                away += now[j, c, d] * joints[j, d]
            for a in range(3):
                inputs_out[6 + 3 * k + a] += away * now[key, c, a]
