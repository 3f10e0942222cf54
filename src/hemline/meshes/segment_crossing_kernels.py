"""Compiled kernel that counts how many triangles each segment goes through."""

from hemline.compiled import kernel
from hemline.meshes.crossing_kernels import segment_crosses


@kernel
def crossings_of_segments(points, segments, x, faces, count_out):
    """Counts the triangles that each segment goes through, see `segment_crosses`.

    Reads: points (points, 3) [m]; segments (segments, 2): indices of their ends; x (verts, 3) [m]; faces (faces, 3).
    Writes: count_out (segments,).
    """
    count_out[:] = 0
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = x[i, 0], x[i, 1], x[i, 2]
        bx, by, bz = x[j, 0], x[j, 1], x[j, 2]
        cx, cy, cz = x[k, 0], x[k, 1], x[k, 2]
        lx, ly, lz = min(ax, bx, cx), min(ay, by, cy), min(az, bz, cz)
        hx, hy, hz = max(ax, bx, cx), max(ay, by, cy), max(az, bz, cz)
        for s in range(segments.shape[0]):
            p, q = segments[s, 0], segments[s, 1]
            px, py, pz = points[p, 0], points[p, 1], points[p, 2]
            dx, dy, dz = points[q, 0] - px, points[q, 1] - py, points[q, 2] - pz
            if max(px, px + dx) < lx or min(px, px + dx) > hx or max(py, py + dy) < ly or min(py, py + dy) > hy:
                continue
            if max(pz, pz + dz) < lz or min(pz, pz + dz) > hz:
                continue
            if segment_crosses(points[p], points[q], x[i], x[j], x[k]):
                count_out[s] += 1


__all__ = ["crossings_of_segments"]
