"""Compiled kernels of `embedding`: frames of coarse vertices, and fine vertices that follow them."""

from math import atan2, copysign, cos, sin

from hemline.compiled import kernel, prange


@kernel(parallel=True)
def turn_frames(points, normals, start, ring, slopes, frames_out):
    """Computes the frame of each vertex: its normal, and tangents turned as its ring turned in its plane.

    Args:
        points: Current positions of the coarse vertices (verts, 3) [m].
        normals: Unit normals at these vertices (verts, 3).
        start: Index at which the ring of each vertex begins in `ring` (verts + 1,).
        ring: Neighbours of the vertices, ring after ring.
        slopes: Contribution of each edge of a ring to the images of the two tangents at rest (ring, 2) [1/m].
        frames_out: Two tangents and the normal as columns, a rotation (verts, 3, 3).
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

    Args:
        points: Current positions of the coarse vertices (coarse, 3) [m].
        frames: Frames of the coarse vertices (coarse, 3, 3).
        near: Coarse vertices of each vertex (verts, near).
        weights: Weights of these coarse vertices (verts, near); each row adds up to 1.
        offsets: Position at rest of the fine vertex in each of their frames (verts, near, 3) [m].
        vertices_out: Fine vertices (verts, 3) [m].
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
