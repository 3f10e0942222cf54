"""Compiled kernels of dual-quaternion skinning."""

import numpy as np

from hemline.compiled import kernel


@kernel
def dual_quaternions(transforms, duals_out):
    """Computes unit dual quaternions of rigid transforms.

    Reads: transforms (joints, 3, 4).
    Writes: duals_out (joints, 8): wxyz twice.
    """
    for j in range(len(transforms)):
        m = transforms[j]
        squares = np.array(
            [
                1 + m[0, 0] + m[1, 1] + m[2, 2],
                1 + m[0, 0] - m[1, 1] - m[2, 2],
                1 - m[0, 0] + m[1, 1] - m[2, 2],
                1 - m[0, 0] - m[1, 1] + m[2, 2],
            ]
        )
        best = np.argmax(squares)
        a, b, c = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
        d, e, f = m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1]
        if best == 0:
            w, x, y, z = squares[0], a, b, c
        elif best == 1:
            w, x, y, z = a, squares[1], d, e
        elif best == 2:
            w, x, y, z = b, d, squares[2], f
        else:
            w, x, y, z = c, e, f, squares[3]
        scale = 1 / np.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * scale, x * scale, y * scale, z * scale
        tx, ty, tz = m[0, 3], m[1, 3], m[2, 3]
        duals_out[j, 0], duals_out[j, 1], duals_out[j, 2], duals_out[j, 3] = w, x, y, z
        duals_out[j, 4] = -0.5 * (tx * x + ty * y + tz * z)
        duals_out[j, 5] = 0.5 * (tx * w + ty * z - tz * y)
        duals_out[j, 6] = 0.5 * (ty * w + tz * x - tx * z)
        duals_out[j, 7] = 0.5 * (tz * w + tx * y - ty * x)


@kernel(fastmath={"contract"})
def skin_dual(transforms, duals, weight_indices, weights, points, points_out):
    """Skins points with dual quaternions. Points that follow a single joint take its transform as it is.

    Reads: transforms (joints, 3, 4); duals (joints, 8): of `dual_quaternions`; weight_indices, weights (points,
        influences); points (points, 3) at rest [m].
    Writes: points_out (points, 3): in the pose [m].
    """
    for v in range(len(points)):
        first = np.uintp(weight_indices[v, 0])
        a, b, c = points[v, 0], points[v, 1], points[v, 2]
        if weights[v, 0] == 1:
            for row in range(3):
                m0, m1, m2 = transforms[first, row, 0], transforms[first, row, 1], transforms[first, row, 2]
                points_out[v, row] = m0 * a + m1 * b + m2 * c + transforms[first, row, 3]
            continue
        fw, fx, fy, fz = duals[first, 0], duals[first, 1], duals[first, 2], duals[first, 3]
        w = x = y = z = dw = dx = dy = dz = np.float32(0)
        for i in range(weights.shape[1]):
            weight = weights[v, i]
            if weight == 0:
                break
            j = np.uintp(weight_indices[v, i])
            if fw * duals[j, 0] + fx * duals[j, 1] + fy * duals[j, 2] + fz * duals[j, 3] < 0:
                weight = -weight
            w += weight * duals[j, 0]
            x += weight * duals[j, 1]
            y += weight * duals[j, 2]
            z += weight * duals[j, 3]
            dw += weight * duals[j, 4]
            dx += weight * duals[j, 5]
            dy += weight * duals[j, 6]
            dz += weight * duals[j, 7]
        scale = np.float32(1) / np.sqrt(w * w + x * x + y * y + z * z)
        w, x, y, z = w * scale, x * scale, y * scale, z * scale
        dw, dx, dy, dz = dw * scale, dx * scale, dy * scale, dz * scale
        ux, uy, uz = y * c - z * b + w * a, z * a - x * c + w * b, x * b - y * a + w * c
        points_out[v, 0] = a + 2 * (y * uz - z * uy + w * dx - dw * x + y * dz - z * dy)
        points_out[v, 1] = b + 2 * (z * ux - x * uz + w * dy - dw * y + z * dx - x * dz)
        points_out[v, 2] = c + 2 * (x * uy - y * ux + w * dz - dw * z + x * dy - y * dx)
