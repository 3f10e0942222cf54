"""Pushing of points out of the body's primitives, compiled."""

import numpy as np

from hemline.animators.ropes.mechanics.joint_frame_kernels import rotate, to_rest, to_world
from hemline.collide.primitives.primitive_kernels import round_cone_distance
from hemline.compiled import kernel

PUSH_ROUNDS = 4
"""Number of pushes of each point, since a point that leaves one primitive may enter another."""


@kernel
def deepest_primitive(kinds, joints, shapes, balls, frames, margin, point):
    """Finds the primitive that a point is deepest in.

    Reads: kinds, joints (prims,); shapes (prims, 16); balls (prims, 4): balls around the primitives in the world, grown
        by margin, with squared radii [m, m^2]; frames (joints, 3, 4); margin [m]; point: x, y, z [m].
    Returns: the depth below margin, 0 outside of all [m]; x, y, z of the unit normal there.
    """
    x, y, z = point
    depth, nx, ny, nz = 0.0, 0.0, 0.0, 0.0
    for k in range(kinds.shape[0]):
        a, b, c = x - balls[k, 0], y - balls[k, 1], z - balls[k, 2]
        if a * a + b * b + c * c >= balls[k, 3]:
            continue
        j = joints[k]
        px, py, pz = to_rest(frames, j, x, y, z)
        found = round_cone_distance(shapes, k, px, py, pz)
        if margin - found[0] > depth:
            depth = margin - found[0]
            nx, ny, nz = rotate(frames, j, found[1], found[2], found[3])
    return depth, nx, ny, nz


@kernel
def push_points_out(kinds, joints, shapes, centres, frames, margins, points_out):
    """Pushes each point along the shortest path to its margin from the primitive that it is deepest in.

    Reads: kinds, joints (prims,); shapes (prims, 16); centres (prims, 4): balls around the primitives at rest [m];
        frames (joints, 3, 4); margins (points,) [m].
    Writes: points_out (points, 3): changed [m].
    """
    widest = margins.max()
    balls = np.empty((kinds.shape[0], 4))
    for k in range(kinds.shape[0]):
        x, y, z = to_world(frames, joints[k], centres[k, 0], centres[k, 1], centres[k, 2])
        balls[k, 0], balls[k, 1], balls[k, 2] = x, y, z
        balls[k, 3] = max(centres[k, 3] + widest, 0.0) ** 2
    for i in range(points_out.shape[0]):
        for _ in range(PUSH_ROUNDS):
            depth, nx, ny, nz = deepest_primitive(
                kinds, joints, shapes, balls, frames, margins[i], (points_out[i, 0], points_out[i, 1], points_out[i, 2])
            )
            if depth <= 0.0:
                break
            points_out[i, 0] += depth * nx
            points_out[i, 1] += depth * ny
            points_out[i, 2] += depth * nz
