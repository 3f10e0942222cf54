"""Compiled parts of a frame that avoid large intermediate arrays."""

import numpy as np

from hemline.animators.swingar.curve_kernels import tangent
from hemline.animators.swingar.layer_kernels import (
    FAST_MATH,
    F,
    add_gathered,
    attend_slab,
    fill_halves,
    length_of,
    project_slab,
)
from hemline.compiled import kernel, prange


@kernel(parallel=True, fastmath=FAST_MATH)
def attend_condensed(
    start, ring, x, scale, weights, extra, extra_weights, vectors, alpha, normalised, vector, means_out, scores_out
):
    """Applies the state encoder and condenses its heads, see `attend` and `condense`; the state itself is not stored.

    # in:  x (heads,verts,F); scale (F,); weights (heads,F,D); extra (verts,L), extra_weights (heads,L,D);
    #      vectors (heads,2,D); vector (D,)
    # out: means_out (chunks,verts,D), whose sum is the mean of heads; scores_out (verts,heads)
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


@kernel(fastmath=FAST_MATH)
def recall(given, recurrent, hidden_out):
    """Computes the last hidden state of an LSTM that begins at zero."""
    # in:  given (poses,4 H): terms of the inputs in the gates input, forget, cell, output; recurrent (H,4 H)
    # out: hidden_out (H,)
    width = recurrent.shape[0]
    cell, gates = np.zeros(width, np.float32), np.empty(4 * width, np.float32)
    hidden_out[:] = F(0.0)
    half = F(0.5)
    for pose in range(given.shape[0]):
        for j in range(4 * width):
            gates[j] = given[pose, j]
        for k in range(width):
            value = hidden_out[k]
            for j in range(4 * width):
                gates[j] += value * recurrent[k, j]
        for k in range(width):
            opened = half + half * tangent(half * gates[k])
            kept = half + half * tangent(half * gates[width + k])
            shown = half + half * tangent(half * gates[3 * width + k])
            cell[k] = kept * cell[k] + opened * tangent(gates[2 * width + k])
            hidden_out[k] = shown * tangent(cell[k])


@kernel(parallel=True, fastmath=FAST_MATH)
def fill_mesh_features(mesh, joints, features_out):
    """Writes the position of each vertex and its distance to each joint."""
    # in: mesh (verts,3), joints (joints,3) [m]; out: features_out (verts,3+joints)
    for i in prange(mesh.shape[0]):
        for c in range(3):
            features_out[i, c] = mesh[i, c]
        for j in range(joints.shape[0]):
            square = F(0.0)
            for c in range(3):
                square += (mesh[i, c] - joints[j, c]) ** 2
            features_out[i, 3 + j] = np.sqrt(square)


@kernel(parallel=True, fastmath=FAST_MATH)
def pass_gates(gates, peepholes, cell, hidden_out):
    """Advances the LSTM over a graph by one step (Eq. 6)."""
    # in:  gates (4,verts,D): input, forget, output, new; peepholes (3,D)
    # in and out: cell (verts,D); out: hidden_out (verts,D)
    half = F(0.5)
    for i in prange(cell.shape[0]):
        for d in range(cell.shape[1]):
            before = cell[i, d]
            opened = half + half * tangent(half * (gates[0, i, d] + peepholes[0, d] * before))
            kept = half + half * tangent(half * (gates[1, i, d] + peepholes[1, d] * before))
            shown = half + half * tangent(half * (gates[2, i, d] + peepholes[2, d] * before))
            cell[i, d] = opened * tangent(gates[3, i, d] + kept * before)
            hidden_out[i, d] = shown * tangent(cell[i, d])
