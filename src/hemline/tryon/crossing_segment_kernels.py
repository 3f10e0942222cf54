"""Segments that go through triangles."""

from hemline.compiled import kernel


@kernel
def crossings_of_segments(points, segments, x, faces, count_out):
    """How many triangles each segment goes through.

    # in:  points (points, 3), segments (segments, 2): their ends; x (verts, 3), faces (faces, 3)
    # out: count_out (segments,)
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
            # Moeller and Trumbore 1997
            ux, uy, uz = bx - ax, by - ay, bz - az
            vx, vy, vz = cx - ax, cy - ay, cz - az
            nx, ny, nz = dy * vz - dz * vy, dz * vx - dx * vz, dx * vy - dy * vx
            det = ux * nx + uy * ny + uz * nz
            if abs(det) < 1e-14:
                continue
            tx, ty, tz = px - ax, py - ay, pz - az
            first = (tx * nx + ty * ny + tz * nz) / det
            if first < 0.0 or first > 1.0:
                continue
            mx, my, mz = ty * uz - tz * uy, tz * ux - tx * uz, tx * uy - ty * ux
            second = (dx * mx + dy * my + dz * mz) / det
            if second < 0.0 or first + second > 1.0:
                continue
            along = (vx * mx + vy * my + vz * mz) / det
            if 0.0 <= along <= 1.0:
                count_out[s] += 1


__all__ = ["crossings_of_segments"]
