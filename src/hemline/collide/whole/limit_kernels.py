"""Compiled: edges that are too long are shortened, on the control vertices and on all vertices."""

import numpy as np

from hemline.compiled import kernel

from .plane_kernels import move_point

_index = np.uintp
PUSH = np.float32(1.4)
"""Over-relaxation of the push out of a half-space."""


@kernel(forceinline=True)
def shorten(places, free, a, b, most):
    """Pulls the ends of an edge together where it is longer than it may be.

    Reads: free (n,): 1, or 0 for vertices that do not move; a, b: the ends; most: longest length [m].
    Writes: places (n, 3) [m].
    """
    x, y, z = places[b, 0] - places[a, 0], places[b, 1] - places[a, 1], places[b, 2] - places[a, 2]
    squared = x * x + y * y + z * z
    if squared > most * most:
        length, for_a, for_b = np.sqrt(squared), free[a], free[b]
        pull = (length - most) / (length * max(for_a + for_b, np.float32(1)))
        for_a, for_b = pull * for_a, pull * for_b
        places[a, 0] += for_a * x
        places[a, 1] += for_a * y
        places[a, 2] += for_a * z
        places[b, 0] -= for_b * x
        places[b, 1] -= for_b * y
        places[b, 2] -= for_b * z


@kernel
def decay_shifts(shifts, factor, most, shifts_out):
    """Fades the shifts of the last frame by a factor, but by no more than `most`.

    Reads: shifts (controls, 3) [m]; factor: 0 to 1, by an exponential; most: largest loss [m].
    Writes: shifts_out (controls, 3) [m].
    """
    for c in range(len(shifts)):
        x, y, z = shifts[c, 0], shifts[c, 1], shifts[c, 2]
        size = np.sqrt(x * x + y * y + z * z)
        kept = max(factor, np.float32(1) - most / max(size, np.float32(1e-9)))
        shifts_out[c, 0], shifts_out[c, 1], shifts_out[c, 2] = kept * x, kept * y, kept * z


@kernel
def limit_coarse(points, model, planes, constrained, sweeps, shifts_out):
    """Shortens coarse edges in sweeps to and fro, each followed by one that pushes samples into their half-spaces.

    Reads: points (verts, 3) [m]; model: a `CoarseModel`; planes (samples, 4) and constrained (constrained,) of
        `constrain_samples`; sweeps.
    Writes: shifts_out (controls, 3) [m].
    """
    shifts = shifts_out
    edges, lengths, free, ids, weights = model.edges, model.lengths, model.free, model.weight_ids, model.weights
    zero, near = np.float32(0), weights.shape[1]
    places, start, scale = (
        np.empty_like(shifts),
        np.empty((len(constrained), 3), np.float32),
        np.empty(len(constrained), np.float32),
    )
    for c in range(len(shifts)):
        i = _index(model.controls[c])
        for axis in range(3):
            places[c, axis] = points[i, axis] + shifts[c, axis]
            shifts[c, axis] = points[i, axis]
    for m in range(len(constrained)):
        i = _index(model.samples[_index(constrained[m])])
        x, y, z, total = points[i, 0], points[i, 1], points[i, 2], zero
        for k in range(near):
            c, w = _index(ids[i, k]), weights[i, k]
            x, y, z = x - w * shifts[c, 0], y - w * shifts[c, 1], z - w * shifts[c, 2]
            total += w * w
        start[m, 0], start[m, 1], start[m, 2], scale[m] = x, y, z, PUSH / total
    for sweep in range(sweeps):
        for turn in range(len(edges)):
            e = _index(turn if sweep % 2 == 0 else len(edges) - 1 - turn)
            shorten(places, free, _index(edges[e, 0]), _index(edges[e, 1]), lengths[e])
        for m in range(len(constrained)):
            s = _index(constrained[m])
            i = _index(model.samples[s])
            x, y, z = start[m, 0], start[m, 1], start[m, 2]
            for k in range(near):
                c, w = _index(ids[i, k]), weights[i, k]
                x, y, z = x + w * places[c, 0], y + w * places[c, 1], z + w * places[c, 2]
            nx, ny, nz = planes[s, 0], planes[s, 1], planes[s, 2]
            depth = planes[s, 3] - (nx * x + ny * y + nz * z)
            if depth <= zero:
                continue
            push = scale[m] * depth
            for k in range(near):
                c = _index(ids[i, k])
                pull = push * weights[i, k] * free[c]
                places[c, 0] += pull * nx
                places[c, 1] += pull * ny
                places[c, 2] += pull * nz
    for c in range(len(shifts)):
        for axis in range(3):
            shifts[c, axis] = places[c, axis] - shifts[c, axis]


@kernel
def carry_vertices(cloth, model, offsets, keep, moved_out, carried_out):
    """Moves all vertices with their control vertices, and by a fraction of the last frame's fine offsets.

    Reads: cloth: a `ShiftedCloth`; model: a `CoarseModel`; offsets (verts, 3): fine offsets of the last frame [m];
        keep: fraction of them, 0 to 1.
    Writes: moved_out (verts, 3) [m]; carried_out (verts, 3): vertices without the offsets [m].
    """
    for i in range(len(cloth.points)):
        x, y, z = move_point(cloth, model, i)
        carried_out[i, 0], carried_out[i, 1], carried_out[i, 2] = x, y, z
        moved_out[i, 0] = x + keep * offsets[i, 0]
        moved_out[i, 1] = y + keep * offsets[i, 1]
        moved_out[i, 2] = z + keep * offsets[i, 2]


@kernel
def limit_fine(model, stretch, sweeps, moved):
    """Shortens edges that are too long, in sweeps back and forth; after the first sweep, only where something moved.

    Each block of edges is first checked without a branch; then those that are too long are shortened one after another.

    Reads: model: a `FineModel`; stretch: longest length, over the length at rest; sweeps.
    Writes: moved (verts, 3) [m].
    Returns: how often an edge was shortened.
    """
    edges, longest, free, size = model.edges, model.lengths, model.free, model.block_size
    zero, total_count, blocks = np.float32(0), 0, len(model.block_start) - 1
    active, touched = np.ones(blocks, np.bool_), np.zeros(blocks, np.bool_)
    most_edges = 0
    for block in range(blocks):
        most_edges = max(most_edges, model.block_start[block + 1] - model.block_start[block])
    listed, limit = np.empty(most_edges + 1, np.int64), stretch * stretch
    for sweep in range(sweeps):
        for turn in range(blocks):
            block = turn if sweep % 2 == 0 else blocks - 1 - turn
            if not active[block]:
                continue
            count = np.int64(0)
            for place in range(model.block_start[block], model.block_start[block + 1]):
                e = _index(place)
                a, b = _index(edges[e, 0]), _index(edges[e, 1])
                x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
                listed[_index(count)] = place
                count += np.int64(x * x + y * y + z * z > limit * longest[e] * longest[e])
            for k in range(count):
                e = _index(listed[_index(k if sweep % 2 == 0 else count - 1 - k)])
                a, b = _index(edges[e, 0]), _index(edges[e, 1])
                x, y, z = moved[b, 0] - moved[a, 0], moved[b, 1] - moved[a, 1], moved[b, 2] - moved[a, 2]
                length, most = np.sqrt(x * x + y * y + z * z), stretch * longest[e]
                pull = max(length - most, zero) / (length * (free[a] + free[b]))
                for_a, for_b = pull * free[a], pull * free[b]
                moved[a, 0] += for_a * x
                moved[a, 1] += for_a * y
                moved[a, 2] += for_a * z
                moved[b, 0] -= for_b * x
                moved[b, 1] -= for_b * y
                moved[b, 2] -= for_b * z
                touched[a // _index(size)] = True
                touched[b // _index(size)] = True
            total_count += count
        active[:] = False
        for block in range(blocks):
            if touched[block]:
                touched[block] = False
                for k in range(model.beside_start[block], model.beside_start[block + 1]):
                    active[model.beside[k]] = True
    return total_count
