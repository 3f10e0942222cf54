"""Compiled: the two parts of a played frame that would otherwise write and read what nobody asks for."""

import numpy as np

from hemline.animators.swingar.curve_kernels import tangent
from hemline.animators.swingar.layer_kernels import (
    FAST,
    F,
    add_gathered,
    attend_slab,
    fill_halves,
    length_of,
    project_slab,
)
from hemline.compiled import kernel, prange


@kernel(parallel=True, fastmath=FAST)
def attend_condensed(
    start, ring, x, scale, weights, extra, extra_weights, vectors, alpha, normalised, vector, means_out, scores_out
):
    """The state encoder and what is made of all its heads, see `attend` and `condense`; the state itself is not kept.

    # in:  x (heads,verts,F); scale (F,); weights (heads,F,D); extra (verts,L), extra_weights (heads,L,D);
    #      vectors (heads,2,D); vector (D,)
    # out: means_out (chunks,verts,D): their sum is the mean of heads; scores_out (verts,heads)
    """
    heads, chunks = weights.shape[0], means_out.shape[0]
    count, width = means_out.shape[1:]
    share = F(1.0) / F(heads)
    for unsigned in prange(chunks):
        chunk = np.int64(unsigned)
        mean = means_out[chunk]
        mean[:] = F(0.0)
        halves = np.empty((3, count), np.float32)
        slab, state = np.empty((count, width), np.float32), np.empty((count, width), np.float32)
        attention = np.empty(len(ring), np.float32)
        for head in range(chunk * heads // chunks, (chunk + 1) * heads // chunks):
            project_slab(x[head], scale, weights[head], extra, extra_weights[head], slab)
            fill_halves(slab, vectors[head], halves)
            attend_slab(start, ring, halves, length_of(vectors[head]), alpha, normalised, attention)
            state[:] = F(0.0)
            add_gathered(start, ring, attention, slab, state)
            for i in range(count):
                row, target, total = state[i], mean[i], F(0.0)
                for d in range(width):
                    value = tangent(row[d])
                    total += value * vector[d]
                    target[d] += share * value
                scores_out[i, head] = total


@kernel(fastmath=FAST)
def recall(given, recurrent, hidden_out):
    """The last hidden state of a long short-term memory that begins at zero."""
    # in:  given (poses,4 H): what the inputs add to the gates input, forget, cell, output; recurrent (H,4 H)
    # out: hidden_out (H,)
    width = recurrent.shape[0]
    cell, gates = np.zeros(width, np.float32), np.empty(4 * width, np.float32)
    hidden_out[:] = F(0.0)
    half = F(0.5)
    for pose in range(given.shape[0]):
        for j in range(4 * width):
            gates[j] = given[pose, j]
        for k in range(width):
            share = hidden_out[k]
            for j in range(4 * width):
                gates[j] += share * recurrent[k, j]
        for k in range(width):
            taken = half + half * tangent(half * gates[k])
            kept = half + half * tangent(half * gates[width + k])
            shown = half + half * tangent(half * gates[3 * width + k])
            cell[k] = kept * cell[k] + taken * tangent(gates[2 * width + k])
            hidden_out[k] = shown * tangent(cell[k])
