"""Compiled: triangles of one mesh that cross each other; a grid finds pairs, orientations decide."""

from hemline.compiled import kernel


@kernel(inline="always")
def volume(a, b, c, d):
    """Computes six times the signed volume of a tetrahedron.

    Reads: a, b, c, d (3,): corners [m].
    Returns: The volume [m^3].
    """
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    wx, wy, wz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    return (uy * vz - uz * vy) * wx + (uz * vx - ux * vz) * wy + (ux * vy - uy * vx) * wz


@kernel
def segment_crosses(p, q, a, b, c):
    """Tells whether the ends of segment p q lie strictly on both sides of triangle a b c, and it meets the triangle.

    It is the only test of segments against triangles, apart from `sim.contact.pairs.pair_search_kernels.pierces`: the
    simulator finds its crossings by an independent test, so that this one can check the result.

    Reads: p, q, a, b, c (3,) [m].
    Returns: Whether the segment crosses the triangle.
    """
    if volume(a, b, c, p) * volume(a, b, c, q) >= 0.0:
        return False
    first, second, third = volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)
    above = first >= 0.0 and second >= 0.0 and third >= 0.0
    below = first <= 0.0 and second <= 0.0 and third <= 0.0
    return above or below


@kernel
def cell_ranges(vertices, faces, origin, cell, low_out, high_out):
    """Computes the first and last cell of each triangle's box along each axis.

    Reads: vertices (verts, 3) [m]; faces (faces, 3); origin (3,) and cell of the grid [m].
    Writes: low_out, high_out (faces, 3).
    """
    for f in range(len(faces)):
        for k in range(3):
            x = vertices[faces[f, 0], k]
            y = vertices[faces[f, 1], k]
            z = vertices[faces[f, 2], k]
            low_out[f, k] = int((min(x, y, z) - origin[k]) / cell)
            high_out[f, k] = int((max(x, y, z) - origin[k]) / cell)


@kernel
def fill_cells(low, high, counts, starts, members_out):
    """Lists the triangles of each cell, one cell after another; with an empty `members_out` it only counts them.

    Reads: low, high (faces, 3): first and last cell; starts: number of cells along the three axes, then the start of
        each cell in `members_out`.
    Writes: counts (cells,), members_out.
    """
    counts[:] = 0
    for f in range(len(low)):
        for i in range(low[f, 0], high[f, 0] + 1):
            for j in range(low[f, 1], high[f, 1] + 1):
                for k in range(low[f, 2], high[f, 2] + 1):
                    cell = (i * starts[1] + j) * starts[2] + k
                    if len(members_out):
                        members_out[starts[3 + cell] + counts[cell]] = f
                    counts[cell] += 1


@kernel
def count_crossings(vertices, faces, low, high, starts, members, edges_out):
    """Counts pairs of triangles that cross and share no vertex.

    Reads: vertices (verts, 3) [m]; faces (faces, 3); low, high (faces, 3): first and last cell; starts: number of cells
        along the three axes, then the start of each cell in members; members.
    Writes: edges_out (faces, 3): 1 where the edge from corner i to corner i + 1 crosses a triangle.
    Returns: the number of pairs.
    """
    pairs = 0
    for cell in range(len(starts) - 4):
        at = (cell // (starts[1] * starts[2]), (cell // starts[2]) % starts[1], cell % starts[2])
        for m in range(starts[3 + cell], starts[4 + cell]):
            for n in range(m + 1, starts[4 + cell]):
                f, g = members[m], members[n]
                apart = False
                for k in range(3):  # a pair in several cells is met once: in the first cell that both touch
                    if max(low[f, k], low[g, k]) != at[k]:
                        apart = True
                for i in range(3):
                    for j in range(3):
                        if faces[f, i] == faces[g, j]:
                            apart = True
                if apart:
                    continue
                for k in range(3):
                    fl = min(vertices[faces[f, 0], k], vertices[faces[f, 1], k], vertices[faces[f, 2], k])
                    fh = max(vertices[faces[f, 0], k], vertices[faces[f, 1], k], vertices[faces[f, 2], k])
                    gl = min(vertices[faces[g, 0], k], vertices[faces[g, 1], k], vertices[faces[g, 2], k])
                    gh = max(vertices[faces[g, 0], k], vertices[faces[g, 1], k], vertices[faces[g, 2], k])
                    if fh < gl or gh < fl:
                        apart = True
                if apart:
                    continue
                crossed = False
                for i in range(3):
                    p, q = vertices[faces[f, i]], vertices[faces[f, (i + 1) % 3]]
                    if segment_crosses(p, q, vertices[faces[g, 0]], vertices[faces[g, 1]], vertices[faces[g, 2]]):
                        edges_out[f, i] = 1
                        crossed = True
                    p, q = vertices[faces[g, i]], vertices[faces[g, (i + 1) % 3]]
                    if segment_crosses(p, q, vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]):
                        edges_out[g, i] = 1
                        crossed = True
                if crossed:
                    pairs += 1
    return pairs
