"""Inputs of the learned bones from the body in one frame, compiled: `body_inputs.body_inputs` for one pose."""

import numpy as np

from hemline.compiled import kernel


@kernel
def place_joints(frames, joints, places_out):
    """Places the joints in a pose.

    Reads: frames (joints, 3, 4); joints (joints, 3) at rest [m].
    Writes: places_out (joints, 3) [m].
    """
    for j in range(joints.shape[0]):
        for a in range(3):
            x, y, z = joints[j, 0], joints[j, 1], joints[j, 2]
            places_out[j, a] = frames[j, a, 0] * x + frames[j, a, 1] * y + frames[j, a, 2] * z + frames[j, a, 3]


@kernel
def spin_between(before, now, key, spin_out):
    """Measures the rotation of the key joint between two poses.

    Reads: before, now (joints, 3, 4); key: index of the key joint.
    Writes: spin_out (3,): sines of the rotation, in the joint's own frame.
    """
    turn = np.zeros((3, 3))
    for a in range(3):
        for b in range(3):
            for c in range(3):
                turn[a, b] += before[key, c, a] * now[key, c, b]
    spin_out[0] = 0.5 * (turn[2, 1] - turn[1, 2])
    spin_out[1] = 0.5 * (turn[0, 2] - turn[2, 0])
    spin_out[2] = 0.5 * (turn[1, 0] - turn[0, 1])


@kernel
def write_body_inputs(joints, key, input_joints, history, now, dt_before, dt, inputs_out):
    """Computes the inputs of the learned bones from the body.

    Reads: joints (joints, 3) at rest [m]; key: index of the key joint; input_joints (n,): `INPUT_JOINTS`; history
        (2 or more, joints, 3, 4): the pose before the last one, and the last one; now (joints, 3, 4); dt_before, dt:
        the times between these three [s].
    Writes: inputs_out (15 + 6 n,), in the order of `body_inputs`.
    """
    before, then = history[0], history[1]
    places, spins = np.empty((3, joints.shape[0], 3)), np.empty((2, 3))
    for pose, frames in enumerate((before, then, now)):
        place_joints(frames, joints, places[pose])
    spin_between(before, then, key, spins[0])
    spin_between(then, now, key, spins[1])
    for a in range(3):
        speed, change = 0.0, 0.0
        for c in range(3):
            velocity = (places[2, key, c] - places[1, key, c]) / dt
            earlier = (places[1, key, c] - places[0, key, c]) / dt_before
            speed += now[key, c, a] * velocity
            change += now[key, c, a] * (velocity - earlier)
        inputs_out[a] = -now[key, 1, a]
        inputs_out[3 + a], inputs_out[6 + a] = speed, change
        inputs_out[9 + a] = spins[1, a] / dt
        inputs_out[12 + a] = spins[1, a] / dt - spins[0, a] / dt_before
    count = input_joints.shape[0]
    for k in range(count):
        j = input_joints[k]
        for a in range(3):
            here, there = 0.0, 0.0
            for c in range(3):
                here += (places[2, j, c] - now[key, c, 3]) * now[key, c, a]
                there += (places[1, j, c] - then[key, c, 3]) * then[key, c, a]
            inputs_out[15 + 3 * k + a] = here - joints[j, a]
            inputs_out[15 + 3 * (count + k) + a] = (here - there) / dt
