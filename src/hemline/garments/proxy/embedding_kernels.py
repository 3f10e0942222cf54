"""Compiled kernels of `embedding`: frames of coarse vertices, and fine vertices that follow them."""

from math import atan2, copysign, cos, sin

from hemline.compiled import kernel, prange


@kernel(parallel=True)
def turn_frames(points, normals, start, ring, slopes, frames_out):
    """Computes the frame of each vertex: its normal, and tangents turned as its ring turned in its plane.

    Reads: points (verts, 3): current positions of the coarse vertices [m]; normals (verts, 3): unit normals there;
        start (verts + 1,): where each vertex begins in `ring`; ring (ring,): neighbours, vertex by vertex; slopes
        (ring, 2): contribution of each neighbour to the images of the two tangents at rest [1/m].
    Writes: frames_out (verts, 3, 3): two tangents and the normal as columns, a rotation.
    """
    for v in prange(len(points)):
        ax = ay = az = bx = by = bz = 0.0
        for k in range(start[v], start[v + 1]):
            j, s, t = ring[k], slopes[k, 0], slopes[k, 1]
            x, y, z = points[j, 0] - points[v, 0], points[j, 1] - points[v, 1], points[j, 2] - points[v, 2]
            ax, ay, az = ax + s * x, ay + s * y, az + s * z
            bx, by, bz = bx + t * x, by + t * y, bz + t * z
        # any two tangents (Duff et al. 2017)
        nx, ny, nz = normals[v, 0], normals[v, 1], normals[v, 2]
        sign = copysign(1.0, nz)
        c = -1.0 / (sign + nz)
        d = nx * ny * c
        ux, uy, uz = 1.0 + sign * nx * nx * c, sign * d, -sign * nx
        wx, wy, wz = d, sign + ny * ny * c, -ny
        # the rotation of the two images in that plane
        across = ax * wx + ay * wy + az * wz - bx * ux - by * uy - bz * uz
        along = ax * ux + ay * uy + az * uz + bx * wx + by * wy + bz * wz
        angle = atan2(across, along)
        p, q = cos(angle), sin(angle)
        frames_out[v, 0, 0], frames_out[v, 0, 1], frames_out[v, 0, 2] = p * ux + q * wx, p * wx - q * ux, nx
        frames_out[v, 1, 0], frames_out[v, 1, 1], frames_out[v, 1, 2] = p * uy + q * wy, p * wy - q * uy, ny
        frames_out[v, 2, 0], frames_out[v, 2, 1], frames_out[v, 2, 2] = p * uz + q * wz, p * wz - q * uz, nz


@kernel(parallel=True)
def carry(points, frames, near, weights, offsets, vertices_out):
    """Computes fine vertices as weighted means of the points to which coarse frames move them.

    Reads: points (coarse, 3): current positions of the coarse vertices [m]; frames (coarse, 3, 3): of `turn_frames`;
        near, weights (verts, near): coarse vertices of each fine vertex, and their weights, which add up to 1; offsets
        (verts, near, 3): position at rest of the fine vertex in each of their frames [m].
    Writes: vertices_out (verts, 3): fine vertices [m].
    """
    for v in prange(len(near)):
        x = y = z = 0.0
        for k in range(near.shape[1]):
            i, w = near[v, k], weights[v, k]
            p, q, r = offsets[v, k, 0], offsets[v, k, 1], offsets[v, k, 2]
            x += w * (points[i, 0] + frames[i, 0, 0] * p + frames[i, 0, 1] * q + frames[i, 0, 2] * r)
            y += w * (points[i, 1] + frames[i, 1, 0] * p + frames[i, 1, 1] * q + frames[i, 1, 2] * r)
            z += w * (points[i, 2] + frames[i, 2, 0] * p + frames[i, 2, 1] * q + frames[i, 2, 2] * r)
        vertices_out[v, 0], vertices_out[v, 1], vertices_out[v, 2] = x, y, z
