"""Compiled graph attention with Lipschitz-normalised scores, forward and backward, one head of one frame at a time.

The projected features of one head of one frame, a *slab*, stay in the second cache while scores, attention and sums
over neighbours are computed from them. Arrays have the layout (frames, heads, verts, features). Edges are those of a
`Graph`: the ring of vertex i is `ring[start[i]:start[i + 1]]`, itself included.
"""

import numpy as np

from hemline.compiled import kernel, prange
from hemline.learning.product_kernels import add_product

from .curve_kernels import fill_exponentials, tangent

F = np.float32
LEAKY_SLOPE = F(0.2)
"""Slope of the leaky rectifier for negative numbers."""
MIN_DIVISOR = F(1e-12)
"""Smallest divisor of a score, for features that are zero."""
FAST_MATH = {"reassoc", "contract", "nsz"}
"""Floating point transformations that the kernels allow."""


@kernel
def project_slab(x, scale, weights, extra, extra_weights, projected_out):
    """Projects the features of one head before attention: `(scale x) weights + extra extra_weights`."""
    # in:  x (verts,F); scale (F,), empty for ones; weights (F,D); extra (verts,L), extra_weights (L,D), L may be 0
    # out: projected_out (verts,D)
    projected_out[:] = F(0.0)
    if scale.shape[0] > 0:
        add_product(x, scale_rows(scale, weights), projected_out)
    else:
        add_product(x, weights, projected_out)
    if extra.shape[1] > 0:
        add_product(extra, extra_weights, projected_out)


@kernel
def scale_rows(scale, weights):
    """Multiplies each row of a matrix by a factor."""
    out = np.empty_like(weights)
    for i in range(weights.shape[0]):
        for j in range(weights.shape[1]):
            out[i, j] = scale[i] * weights[i, j]
    return out


@kernel(fastmath=FAST_MATH)
def fill_halves(projected, vectors, halves_out):
    """Computes the two halves of the scores, of a vertex as center and as neighbour, and its squared norm."""
    # in:  projected (verts,D); vectors (2,D): for centers, for neighbours
    # out: halves_out (3,verts)
    for i in range(projected.shape[0]):
        center, neighbour, square = F(0.0), F(0.0), F(0.0)
        for d in range(projected.shape[1]):
            value = projected[i, d]
            center += value * vectors[0, d]
            neighbour += value * vectors[1, d]
            square += value * value
        halves_out[0, i], halves_out[1, i], halves_out[2, i] = center, neighbour, square


@kernel(fastmath=FAST_MATH)
def length_of(vectors):
    """Returns the norm of both vectors of scores together, the spectral norm of the linear score function."""
    square = F(0.0)
    for d in range(vectors.shape[1]):
        square += vectors[0, d] * vectors[0, d] + vectors[1, d] * vectors[1, d]
    return np.sqrt(square)


@kernel(inline="always")
def divisor_at(i, start, ring, halves, length):
    """Returns the divisor of the scores of a vertex, the neighbour of the largest norm, and whether the bound decides.

    The divisor is the larger one of the norm of its scores and the bound `length sqrt(max_k |x_k|^2 + |x_i|^2)` (Eq. 4,
    in one neighbourhood).
    """
    squares, most, largest = F(0.0), F(-1.0), ring[start[i]]
    for k in range(start[i], start[i + 1]):
        score = halves[0, i] + halves[1, ring[k]]
        squares += score * score
        if halves[2, ring[k]] > most:
            most, largest = halves[2, ring[k]], ring[k]
    scores, bound = np.sqrt(squares), length * np.sqrt(most + halves[2, i])
    return max(max(scores, bound), MIN_DIVISOR), largest, bound >= scores


@kernel(fastmath=FAST_MATH)
def attend_slab(start, ring, halves, length, alpha, normalised, attention_out):
    """Computes the attention of each vertex over its ring: the softmax of rectified, normalised scores."""
    # in:  halves (3,verts), length: see `fill_halves`, `length_of`; alpha: scale of scores; normalised: or raw scores
    # out: attention_out (edges,)
    alpha = F(alpha)
    for i in range(start.shape[0] - 1):
        factor = F(1.0)
        if normalised:
            factor = alpha / divisor_at(i, start, ring, halves, length)[0]
        most = F(-np.inf)
        for k in range(start[i], start[i + 1]):
            score = factor * (halves[0, i] + halves[1, ring[k]])
            score = max(score, LEAKY_SLOPE * score)
            attention_out[k] = score
            most = max(most, score)
        for k in range(start[i], start[i + 1]):
            attention_out[k] -= most
    fill_exponentials(attention_out, attention_out)
    for i in range(start.shape[0] - 1):
        total = F(0.0)
        for k in range(start[i], start[i + 1]):
            total += attention_out[k]
        total = F(1.0) / total
        for k in range(start[i], start[i + 1]):
            attention_out[k] *= total


@kernel(fastmath=FAST_MATH)
def add_gathered(start, ring, attention, projected, out):
    """Adds to each vertex the mean of its ring, weighted by attention."""
    # in: attention (edges,), projected (verts,D); in and out: out (verts,D)
    width = projected.shape[1]
    for i in range(out.shape[0]):
        row = out[i]
        for k in range(start[i], start[i + 1]):
            weight, other = attention[k], projected[ring[k]]
            for d in range(width):
                row[d] += weight * other[d]


@kernel(parallel=True, fastmath=FAST_MATH)
def attend(
    start, ring, x, scale, weights, extra, extra_weights, vectors, alpha, normalised, keep, slabs, attention_out, out
):
    """Applies a layer: `tanh(mean over the heads of a group of softmax(scores) x weights)`.

    # in:  x (1|frames,1|heads,verts,F); scale (frames,F), or (frames,0) for ones; weights (heads,F,D);
    #      extra (frames,verts,L), extra_weights (heads,L,D); vectors (heads,2,D); keep: whether slabs are kept
    # work: slabs (frames,heads,verts,D) where kept, else (frames*groups,1,verts,D)
    # out: attention_out (frames,heads,edges) where kept, else (frames*groups,1,edges); out (frames,groups,verts,D)
    """
    frames, groups, count, width = out.shape
    together = weights.shape[0] // groups
    for unsigned in prange(frames * groups):
        job = np.int64(unsigned)
        frame, group = job // groups, job % groups
        total = out[frame, group]
        total[:] = F(0.0)
        halves = np.empty((3, count), np.float32)
        for head in range(group * together, (group + 1) * together):
            slab = slabs[frame, head] if keep else slabs[job, 0]
            attention = attention_out[frame, head] if keep else attention_out[job, 0]
            features = x[min(frame, x.shape[0] - 1), min(head, x.shape[1] - 1)]
            project_slab(features, scale[frame], weights[head], extra[frame], extra_weights[head], slab)
            fill_halves(slab, vectors[head], halves)
            attend_slab(start, ring, halves, length_of(vectors[head]), alpha, normalised, attention)
            add_gathered(start, ring, attention, slab, total)
        share = F(1.0) / F(together)
        for i in range(count):
            for d in range(width):
                total[i, d] = tangent(share * total[i, d])


@kernel(fastmath=FAST_MATH)
def add_gathered_back(start, ring, attention, projected, back, attention_back_out, projected_back):
    """Computes the backward pass of `add_gathered`."""
    # in: back (verts,D); out: attention_back_out (edges,); in and out: projected_back (verts,D)
    width = projected.shape[1]
    for i in range(back.shape[0]):
        row = back[i]
        for k in range(start[i], start[i + 1]):
            other, target, weight = projected[ring[k]], projected_back[ring[k]], attention[k]
            total = F(0.0)
            for d in range(width):
                total += row[d] * other[d]
                target[d] += weight * row[d]
            attention_back_out[k] = total


@kernel(fastmath=FAST_MATH)
def attend_slab_back(start, ring, halves, length, alpha, normalised, attention, attention_back, halves_back_out):
    """Computes the backward pass of `attend_slab`; returns the gradient of `length`."""
    # in: attention, attention_back (edges,); out: halves_back_out (3,verts)
    alpha = F(alpha)
    halves_back_out[:] = F(0.0)
    length_back = F(0.0)
    for i in range(start.shape[0] - 1):
        factor, divisor, largest, by_norm = F(1.0), F(1.0), ring[start[i]], False
        if normalised:
            divisor, largest, by_norm = divisor_at(i, start, ring, halves, length)
            factor = alpha / divisor
        mean = F(0.0)
        for k in range(start[i], start[i + 1]):
            mean += attention[k] * attention_back[k]
        divisor_back = F(0.0)
        for k in range(start[i], start[i + 1]):
            score = halves[0, i] + halves[1, ring[k]]
            change = attention[k] * (attention_back[k] - mean) * (F(1.0) if score >= F(0.0) else LEAKY_SLOPE)
            halves_back_out[0, i] += factor * change
            halves_back_out[1, ring[k]] += factor * change
            divisor_back -= factor / divisor * score * change
        if not normalised or divisor <= MIN_DIVISOR:
            continue
        if by_norm:
            length_back += divisor_back * divisor / length
            change = divisor_back * F(0.5) * length * length / divisor
            halves_back_out[2, largest] += change
            halves_back_out[2, i] += change
        else:
            for k in range(start[i], start[i + 1]):
                change = divisor_back * (halves[0, i] + halves[1, ring[k]]) / divisor
                halves_back_out[0, i] += change
                halves_back_out[1, ring[k]] += change
    return length_back


@kernel(fastmath=FAST_MATH)
def halves_to_slab_back(projected, vectors, halves_back, length, length_back, projected_back, vectors_back):
    """Adds the backward pass of `fill_halves` and `length_of`."""
    # in and out: projected_back (verts,D), vectors_back (2,D)
    for i in range(projected.shape[0]):
        center, neighbour, square = halves_back[0, i], halves_back[1, i], F(2.0) * halves_back[2, i]
        for d in range(projected.shape[1]):
            value = projected[i, d]
            projected_back[i, d] += center * vectors[0, d] + neighbour * vectors[1, d] + square * value
            vectors_back[0, d] += center * value
            vectors_back[1, d] += neighbour * value
    pull = length_back / max(length, MIN_DIVISOR)
    for half in range(2):
        for d in range(vectors.shape[1]):
            vectors_back[half, d] += pull * vectors[half, d]


@kernel(fastmath=FAST_MATH)
def project_slab_back(
    x, scale, weights, extra, projected_back, wanted, scale_back, weights_back, extra_weights_back, x_back
):
    """Adds the backward pass of `project_slab`. `extra` is data and gets no gradient; `x` gets one if wanted."""
    if scale.shape[0] > 0:
        raw = np.zeros_like(weights)
        add_product(x.T, projected_back, raw)
        for i in range(weights.shape[0]):
            total = F(0.0)
            for j in range(weights.shape[1]):
                weights_back[i, j] += scale[i] * raw[i, j]
                total += weights[i, j] * raw[i, j]
            scale_back[i] += total
        if wanted:
            add_product(projected_back, np.ascontiguousarray(scale_rows(scale, weights).T), x_back)
    else:
        add_product(x.T, projected_back, weights_back)
        if wanted:
            add_product(projected_back, np.ascontiguousarray(weights.T), x_back)
    if extra.shape[1] > 0:
        add_product(extra.T, projected_back, extra_weights_back)


@kernel(parallel=True, fastmath=FAST_MATH)
def attend_back(
    start, ring, x, scale, weights, extra, vectors, alpha, normalised, wanted, slabs, attention, out, back,
    scale_back, weights_back, extra_weights_back, vectors_back, x_back,
):  # fmt: skip
    """Adds the backward pass of `attend` to gradients, which begin as zeros.

    # in: the arguments of `attend`, with the `slabs` and `attention` that it stored; out, back (frames,groups,verts,D);
    #     wanted: whether x_back is filled
    # in and out: scale_back (frames,F); with a leading axis of chunks of frames, to be summed by the caller:
    #      weights_back, extra_weights_back, vectors_back, and x_back if one x serves all frames (else one chunk)
    """
    frames, groups, count, width = out.shape
    together, chunks = weights.shape[0] // groups, weights_back.shape[0]
    share = F(1.0) / F(together)
    for unsigned in prange(chunks):
        chunk = np.int64(unsigned)
        halves, halves_back = np.empty((3, count), np.float32), np.empty((3, count), np.float32)
        before, slab_back = np.empty((count, width), np.float32), np.empty((count, width), np.float32)
        attention_back = np.empty(len(ring), np.float32)
        for frame in range(chunk * frames // chunks, (chunk + 1) * frames // chunks):
            of_frames = min(frame, x.shape[0] - 1)
            of_chunk, back_frame = min(chunk, x_back.shape[0] - 1), min(frame, x_back.shape[1] - 1)
            for group in range(groups):
                for i in range(count):
                    for d in range(width):
                        value = out[frame, group, i, d]
                        before[i, d] = share * back[frame, group, i, d] * (F(1.0) - value * value)
                for head in range(group * together, (group + 1) * together):
                    slab, of_heads = slabs[frame, head], min(head, x.shape[1] - 1)
                    length = length_of(vectors[head])
                    slab_back[:] = F(0.0)
                    add_gathered_back(start, ring, attention[frame, head], slab, before, attention_back, slab_back)
                    fill_halves(slab, vectors[head], halves)
                    length_back = attend_slab_back(
                        start,
                        ring,
                        halves,
                        length,
                        alpha,
                        normalised,
                        attention[frame, head],
                        attention_back,
                        halves_back,
                    )
                    halves_to_slab_back(
                        slab, vectors[head], halves_back, length, length_back, slab_back, vectors_back[chunk, head]
                    )
                    project_slab_back(
                        x[of_frames, of_heads], scale[frame], weights[head], extra[frame], slab_back, wanted,
                        scale_back[frame], weights_back[chunk, head], extra_weights_back[chunk, head],
                        x_back[of_chunk, back_frame, min(head, x_back.shape[2] - 1)],
                    )  # fmt: skip


@kernel(parallel=True, fastmath=FAST_MATH)
def condense(state, vector, mean_out, scores_out):
    """Condenses all heads of the state to their mean and to the product of each with one vector."""
    # in:  state (frames,heads,verts,D), vector (D,)
    # out: mean_out (frames,verts,D), scores_out (frames,verts,heads)
    frames, heads, count, width = state.shape
    share = F(1.0) / F(heads)
    for frame in prange(frames):
        mean_out[frame] = F(0.0)
        for head in range(heads):
            for i in range(count):
                row, mean, total = state[frame, head, i], mean_out[frame, i], F(0.0)
                for d in range(width):
                    total += row[d] * vector[d]
                    mean[d] += share * row[d]
                scores_out[frame, i, head] = total


@kernel(parallel=True, fastmath=FAST_MATH)
def condense_back(state, vector, mean_back, scores_back, state_back_out, vector_back):
    """Computes the backward pass of `condense`; adds to `vector_back`, which has a row for each frame."""
    # in: mean_back (frames,verts,D), scores_back (frames,verts,heads); out: state_back_out
    # in and out: vector_back (frames,D)
    frames, heads, count, width = state.shape
    share = F(1.0) / F(heads)
    for frame in prange(frames):
        total = vector_back[frame]
        for head in range(heads):
            for i in range(count):
                row, back, mean = state[frame, head, i], state_back_out[frame, head, i], mean_back[frame, i]
                pull = scores_back[frame, i, head]
                for d in range(width):
                    back[d] = pull * vector[d] + share * mean[d]
                    total[d] += pull * row[d]
