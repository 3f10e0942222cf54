"""Learned bones out of the body's primitives, compiled."""

from hemline.collide.primitives.primitive_kernels import primitive_distance
from hemline.compiled import kernel

from .rope_collision_kernels import to_rest, to_world, turned

ROUNDS = 4
"""A point that leaves one primitive may enter another: so often the deepest is sought."""


@kernel
def deepest_primitive(kinds, joints, shapes, centres, frames, margin, x, y, z):
    # model: primitives   in: frames (joints, 3, 4), point   returns: depth below margin (0: none), unit normal
    depth, nx, ny, nz = 0.0, 0.0, 0.0, 0.0
    for k in range(kinds.shape[0]):
        j = joints[k]
        cx, cy, cz = to_world(frames, j, centres[k, 0], centres[k, 1], centres[k, 2])
        reach = centres[k, 3] + margin
        if (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2 >= reach * reach:
            continue
        px, py, pz = to_rest(frames, j, x, y, z)
        found = primitive_distance(kinds[k], shapes, k, px, py, pz)
        if margin - found[0] > depth:
            depth = margin - found[0]
            nx, ny, nz = turned(frames, j, found[1], found[2], found[3])
    return depth, nx, ny, nz


@kernel
def push_points_out(kinds, joints, shapes, centres, frames, margin, points_out):
    # model: primitives   in: frames (joints, 3, 4), margin   in/out: points_out (points, 3)
    # Each goes the shortest way to the distance `margin` from the primitive that it is deepest in.
    for i in range(points_out.shape[0]):
        for _ in range(ROUNDS):
            depth, nx, ny, nz = deepest_primitive(
                kinds, joints, shapes, centres, frames, margin, points_out[i, 0], points_out[i, 1], points_out[i, 2]
            )
            if depth <= 0.0:
                break
            points_out[i, 0] += depth * nx
            points_out[i, 1] += depth * ny
            points_out[i, 2] += depth * nz


@kernel
def push_rollouts_out(kinds, joints, shapes, centres, which, frames, margin, points_out):
    # model: kinds, joints (prims,), shapes (bodies, prims, 16), centres (bodies, prims, 4)
    # in: which (rollouts,) body, frames (rollouts, joints, 3, 4), margin   in/out: points_out (rollouts, points, 3)
    for n in range(points_out.shape[0]):
        b = which[n]
        push_points_out(kinds, joints, shapes[b], centres[b], frames[n], margin, points_out[n])
