"""Compiled parts of a frame that avoid large intermediate arrays."""

import numpy as np

from hemline.animators.swingar.curve_kernels import tangent
from hemline.animators.swingar.kernel_inputs import LayerInputs, LayerWeights, Rings, ScoreRule
from hemline.animators.swingar.layer_kernels import (
    FAST_MATH,
    F,
    add_gathered,
    attend_slab,
    fill_halves,
    inputs_at,
    length_of,
    project_slab,
    weights_at,
)
from hemline.compiled import kernel, prange


@kernel(parallel=True, fastmath=FAST_MATH)
def attend_condensed(
    rings: Rings, inputs: LayerInputs, weights: LayerWeights, rule: ScoreRule, vector, means_out, scores_out
):
    """Applies the state encoder and condenses its heads, see `attend` and `condense`; the state itself is not stored.

    Reads: rings; inputs of one frame; weights; rule; vector (D,).
    Writes: means_out (chunks, verts, D), whose sum is the mean of heads; scores_out (verts, heads).
    """
    heads, chunks = weights.vectors.shape[0], means_out.shape[0]
    edge_count = len(rings.ring)
    count, width = means_out.shape[1:]
    share = F(1.0) / F(heads)
    for unsigned in prange(chunks):
        chunk = np.int64(unsigned)
        mean = means_out[chunk]
        mean[:] = F(0.0)
        halves = np.empty((3, count), np.float32)
        slab, state = np.empty((count, width), np.float32), np.empty((count, width), np.float32)
        attention = np.empty(edge_count, np.float32)
        for head in range(chunk * heads // chunks, (chunk + 1) * heads // chunks):
            own = weights_at(weights, head)
            project_slab(inputs_at(inputs, 0, head), own, slab)
            fill_halves(slab, own.vectors, halves)
            attend_slab(rings, halves, length_of(own.vectors), rule, attention)
            state[:] = F(0.0)
            add_gathered(rings, attention, slab, state)
            for i in range(count):
                row, target, total = state[i], mean[i], F(0.0)
                for d in range(width):
                    value = tangent(row[d])
                    total += value * vector[d]
                    target[d] += share * value
                scores_out[i, head] = total


@kernel(fastmath=FAST_MATH)
def recall(given, recurrent, hidden_out):
    """Computes the last hidden state of an LSTM that begins at zero.

    Reads: given (poses, 4 H): terms of the inputs in the gates input, forget, cell, output; recurrent (H, 4 H).
    Writes: hidden_out (H,).
    """
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
    """Computes the position of each vertex and its distance to each joint.

    Reads: mesh (verts, 3), joints (joints, 3) [m].
    Writes: features_out (verts, 3 + joints) [m].
    """
    for i in prange(mesh.shape[0]):
        for c in range(3):
            features_out[i, c] = mesh[i, c]
        for j in range(joints.shape[0]):
            square = F(0.0)
            for c in range(3):
                square += (mesh[i, c] - joints[j, c]) ** 2
            features_out[i, 3 + j] = np.sqrt(square)


@kernel(parallel=True, fastmath=FAST_MATH)
def pass_gates(gates, peepholes, cell_out, hidden_out):
    """Advances the LSTM over a graph by one step (Eq. 6).

    Reads: gates (4, verts, D): input, forget, output, new; peepholes (3, D).
    Writes: cell_out (verts, D): changed; hidden_out (verts, D).
    """
    half = F(0.5)
    for i in prange(cell_out.shape[0]):
        for d in range(cell_out.shape[1]):
            before = cell_out[i, d]
            opened = half + half * tangent(half * (gates[0, i, d] + peepholes[0, d] * before))
            kept = half + half * tangent(half * (gates[1, i, d] + peepholes[1, d] * before))
            shown = half + half * tangent(half * (gates[2, i, d] + peepholes[2, d] * before))
            cell_out[i, d] = opened * tangent(gates[3, i, d] + kept * before)
            hidden_out[i, d] = shown * tangent(cell_out[i, d])
