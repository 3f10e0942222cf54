"""Compiled kernels of forward kinematics, skinning and normals."""

import numpy as np

from hemline.compiled import kernel

# Unsigned indices spare numba the test for negative ones; contraction lets it use fused multiply-add.
_index = np.uintp


@kernel
def turn_columns(q, r_out):
    """Computes the rotation matrix of a unit quaternion.

    Reads: q (4,): wxyz.
    Writes: r_out (3, 3).
    """
    w, x, y, z = q[0], q[1], q[2], q[3]
    r_out[0, 0], r_out[0, 1], r_out[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    r_out[1, 0], r_out[1, 1], r_out[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    r_out[2, 0], r_out[2, 1], r_out[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


@kernel
def product(a, b, out):
    """Multiplies two quaternions.

    Reads: a, b (4,): wxyz.
    Writes: out (4,): may be a or b.
    """
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3]
    z = a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1]
    out[0], out[1], out[2], out[3] = w, x, y, z


@kernel
def pose_joints(rotations, translations, rest_joints, parents, rest_offsets, transforms_out, joints_out):
    """Computes skin transforms and joints of each frame, in float64 inside.

    Reads: rotations (frames, joints, 4); translations (frames, 3) [m]; rest_joints (joints, 3) [m], parents (joints,),
        rest_offsets (joints, 4): the body at rest.
    Writes: transforms_out (frames, joints, 3, 4); joints_out (frames, joints, 3) [m].
    """
    count = len(parents)
    turned = np.empty((count, 4))  # G_j
    skinned = np.empty((count, 4))  # G_j O_j
    matrices = np.empty((count, 3, 3))
    at = np.empty((count, 3))
    for frame in range(len(rotations)):
        for j in range(count):
            p = parents[j]
            if p < 0:
                for c in range(4):
                    turned[j, c] = rotations[frame, j, c]
                for c in range(3):
                    at[j, c] = translations[frame, c]
            else:
                product(turned[p], rotations[frame, j], turned[j])
                for row in range(3):
                    at[j, row] = at[p, row]
                    for c in range(3):
                        bone = np.float64(rest_joints[j, c]) - np.float64(rest_joints[p, c])
                        at[j, row] += matrices[p, row, c] * bone
            norm = np.sqrt(turned[j, 0] ** 2 + turned[j, 1] ** 2 + turned[j, 2] ** 2 + turned[j, 3] ** 2)
            for c in range(4):
                turned[j, c] /= norm
            product(turned[j], rest_offsets[j], skinned[j])
            turn_columns(skinned[j], matrices[j])
            for row in range(3):
                shift = at[j, row]
                for c in range(3):
                    transforms_out[frame, j, row, c] = matrices[j, row, c]
                    shift -= matrices[j, row, c] * rest_joints[j, c]
                transforms_out[frame, j, row, 3] = shift
                joints_out[frame, j, row] = at[j, row]


@kernel(fastmath={"contract"})
def skin_linear(transforms, weight_indices, weights, points, points_out):
    """Skins points by linear blending.

    Reads: transforms (joints, 3, 4); weight_indices, weights (points, influences); points (points, 3) at rest [m].
    Writes: points_out (points, 3): in the pose [m].
    """
    for v in range(len(points)):
        x, y, z = points[v, 0], points[v, 1], points[v, 2]
        px = py = pz = np.float32(0)
        for i in range(weights.shape[1]):
            w = weights[v, i]
            if w == 0:
                break
            j = _index(weight_indices[v, i])
            px += w * (
                transforms[j, 0, 0] * x + transforms[j, 0, 1] * y + transforms[j, 0, 2] * z + transforms[j, 0, 3]
            )
            py += w * (
                transforms[j, 1, 0] * x + transforms[j, 1, 1] * y + transforms[j, 1, 2] * z + transforms[j, 1, 3]
            )
            pz += w * (
                transforms[j, 2, 0] * x + transforms[j, 2, 1] * y + transforms[j, 2, 2] * z + transforms[j, 2, 3]
            )
        points_out[v, 0], points_out[v, 1], points_out[v, 2] = px, py, pz


@kernel(fastmath={"contract"})
def turn_normals(transforms, weight_indices, weights, normals, normals_out):
    """Turns rest normals by the blended rotations, and normalises them.

    Reads: transforms (joints, 3, 4); weight_indices, weights (verts, influences); normals (verts, 3) at rest.
    Writes: normals_out (verts, 3): in the pose.
    """
    for v in range(len(normals)):
        x, y, z = normals[v, 0], normals[v, 1], normals[v, 2]
        px = py = pz = np.float32(0)
        for i in range(weights.shape[1]):
            w = weights[v, i]
            if w == 0:
                break
            j = _index(weight_indices[v, i])
            px += w * (transforms[j, 0, 0] * x + transforms[j, 0, 1] * y + transforms[j, 0, 2] * z)
            py += w * (transforms[j, 1, 0] * x + transforms[j, 1, 1] * y + transforms[j, 1, 2] * z)
            pz += w * (transforms[j, 2, 0] * x + transforms[j, 2, 1] * y + transforms[j, 2, 2] * z)
        scale = np.float32(1) / np.sqrt(max(px * px + py * py + pz * pz, np.float32(1e-30)))
        normals_out[v, 0], normals_out[v, 1], normals_out[v, 2] = px * scale, py * scale, pz * scale


@kernel(fastmath={"contract"})
def area_normals(vertices, faces, normals_out):
    """Computes area-weighted unit normals of vertices.

    Reads: vertices (verts, 3) [m]; faces (faces, 3).
    Writes: normals_out (verts, 3): unit length, or zero where there is no area.
    """
    for v in range(len(vertices)):
        for c in range(3):
            normals_out[v, c] = 0
    for f in range(len(faces)):
        a, b, c = _index(faces[f, 0]), _index(faces[f, 1]), _index(faces[f, 2])
        x, y, z = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        ux, uy, uz = vertices[b, 0] - x, vertices[b, 1] - y, vertices[b, 2] - z
        vx, vy, vz = vertices[c, 0] - x, vertices[c, 1] - y, vertices[c, 2] - z
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        for corner in (a, b, c):
            normals_out[corner, 0] += nx
            normals_out[corner, 1] += ny
            normals_out[corner, 2] += nz
    for v in range(len(vertices)):
        x, y, z = normals_out[v, 0], normals_out[v, 1], normals_out[v, 2]
        scale = np.float32(1) / np.sqrt(max(x * x + y * y + z * z, np.float32(1e-30)))
        normals_out[v, 0], normals_out[v, 1], normals_out[v, 2] = x * scale, y * scale, z * scale
