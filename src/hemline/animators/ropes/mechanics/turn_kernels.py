"""Positions of one node: exact turns on the sphere of a taut rope, paper Eq. 10 to 13."""

import math

from hemline.compiled import kernel


@kernel
def turn_about(x, y, z, vx, vy, vz, time, length):
    """Turns a node about a centre on the sphere of its rope.

    Reads: x, y, z: offset from the centre [m]; vx, vy, vz: velocity [m/s]; time [s]; length of the rope [m].
    Returns: the turned offset, of size length [m].
    """
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
def put_back(x, y, z, vx, vy, vz, time, length):
    """Moves a node straight on, then puts it back on the sphere of its rope, which turns it by less than its path.

    Reads: x, y, z: offset from the centre [m]; vx, vy, vz: velocity [m/s]; time [s]; length of the rope [m].
    Returns: the new offset, of size length [m].
    """
    x, y, z = x + time * vx, y + time * vy, z + time * vz
    ratio = length / math.sqrt(x * x + y * y + z * z)
    return ratio * x, ratio * y, ratio * z


@kernel
def move_node(i, length, pulls, project, h, starts, velocities, positions_out):
    """Moves node i over a substep: Eq. 10 to 13 in the frame of the node above, see `dynamics`.

    Reads: i; length of its rope [m]; pulls: whether the rope pulls; project: whether to put back instead of to turn;
        h: substep [s]; starts (nodes, 3) [m]; velocities (nodes, 3) at the half step [m/s]; positions_out of i - 1.
    Writes: positions_out (nodes, 3): row i [m].
    """
    x, y, z = starts[i, 0] - starts[i - 1, 0], starts[i, 1] - starts[i - 1, 1], starts[i, 2] - starts[i - 1, 2]
    vx, vy, vz = velocities[i, 0], velocities[i, 1], velocities[i, 2]
    left = h
    if pulls:
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
    if project:
        x, y, z = put_back(x, y, z, vx, vy, vz, left, length)
    else:
        x, y, z = turn_about(x, y, z, vx, vy, vz, left, length)
    positions_out[i, 0] = positions_out[i - 1, 0] + x
    positions_out[i, 1] = positions_out[i - 1, 1] + y
    positions_out[i, 2] = positions_out[i - 1, 2] + z
