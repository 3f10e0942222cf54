"""How places of the body slide over its skin: compiled code."""

from hemline.compiled import kernel, prange

from .touch_kernels import closest_around

FARTHEST_WALK = 16
"""Vertices of the body that a walk over the skin goes along, at most."""


@kernel(parallel=True)
def walked_faces(x, vertices, faces, star_starts, star, asked, nearest_out, face_out, weights_out):
    """For each cloth vertex that is asked for the closest face around its last one: downhill over the skin.

    # in:  nearest_out holds the body vertices to start from, -1 for none
    # out: body vertex, face, weights of corners 1 and 2; of the others as they were
    """
    for i in prange(x.shape[0]):
        centre = nearest_out[i]
        if not asked[i] or centre < 0:
            continue
        px, py, pz = x[i, 0], x[i, 1], x[i, 2]
        best = 1e30
        for _ in range(FARTHEST_WALK):
            found = centre
            for entry in range(star_starts[centre], star_starts[centre + 1]):
                for corner in range(3):
                    j = faces[star[entry], corner]
                    d0, d1, d2 = vertices[j, 0] - px, vertices[j, 1] - py, vertices[j, 2] - pz
                    d = d0 * d0 + d1 * d1 + d2 * d2
                    if d < best:
                        best, found = d, j
            if found == centre:
                break
            centre = found
        nearest_out[i] = centre
        face, v, w = closest_around(px, py, pz, centre, vertices, faces, star_starts, star)
        face_out[i], weights_out[i, 0], weights_out[i, 1] = face, v, w


@kernel(parallel=True)
def mark_jumps(faces, before, after, jumped_out):
    """Where two faces, -1 for none, share no corner."""
    for i in prange(before.shape[0]):
        a, b = before[i], after[i]
        jumped_out[i] = a >= 0 and b >= 0
        if not jumped_out[i]:
            continue
        for k in range(3):
            for l in range(3):
                if faces[a, k] == faces[b, l]:
                    jumped_out[i] = False


__all__ = ["mark_jumps", "walked_faces"]
