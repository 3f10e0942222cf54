"""Compiled graph attention with Lipschitz-normalised scores, forward and backward, one head of one frame at a time.

The projected features of one head of one frame, a *slab*, stay in the second cache while scores, attention and sums
over neighbours are computed from them. Arrays have the layout (frames, heads, verts, features). F features of a vertex
enter a layer, L further ones beside them, and D leave it.
"""

import numpy as np

from hemline.compiled import kernel, prange
from hemline.learning.product_kernels import add_product

from .curve_kernels import fill_exponentials, tangent
from .kernel_inputs import LayerGradients, LayerInputs, LayerMemory, LayerWeights, Rings, ScoreRule

F = np.float32
LEAKY_SLOPE = F(0.2)
"""Slope of the leaky rectifier for negative numbers."""
MIN_DIVISOR = F(1e-12)
"""Smallest divisor of a score, for features that are zero."""
FAST_MATH = {"reassoc", "contract", "nsz"}
"""Floating point transformations that the kernels allow."""


@kernel
def project_slab(inputs: LayerInputs, weights: LayerWeights, projected_out):
    """Projects the features of one head of one frame: `(scale x) weights + extra extra_weights`.

    Reads: inputs: x (verts, F), scale (F,) or empty, extra (verts, L); weights: weights (F, D), extra_weights (L, D).
    Writes: projected_out (verts, D).
    """
    projected_out[:] = F(0.0)
    if inputs.scale.shape[0] > 0:
        add_product(inputs.x, scale_rows(inputs.scale, weights.weights), projected_out)
    else:
        add_product(inputs.x, weights.weights, projected_out)
    if inputs.extra.shape[1] > 0:
        add_product(inputs.extra, weights.extra_weights, projected_out)


@kernel
def scale_rows(scale, weights):
    """Multiplies each row of a matrix by a factor.

    Reads: scale (F,); weights (F, D).
    Returns: the product (F, D).
    """
    out = np.empty_like(weights)
    for i in range(weights.shape[0]):
        for j in range(weights.shape[1]):
            out[i, j] = scale[i] * weights[i, j]
    return out


@kernel(fastmath=FAST_MATH)
def fill_halves(projected, vectors, halves_out):
    """Computes the two halves of the scores, of a vertex as center and as neighbour, and its squared norm.

    Reads: projected (verts, D); vectors (2, D): for centers, for neighbours.
    Writes: halves_out (3, verts): halves as center, halves as neighbour, squared norms.
    """
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
    """Computes the norm of both vectors of scores together, the spectral norm of the linear score function.

    Reads: vectors (2, D).
    Returns: the norm.
    """
    square = F(0.0)
    for d in range(vectors.shape[1]):
        square += vectors[0, d] * vectors[0, d] + vectors[1, d] * vectors[1, d]
    return np.sqrt(square)


@kernel(inline="always")
def divisor_at(i, rings: Rings, halves, length):
    """Computes the divisor of the scores of a vertex.

    It is the larger one of the norm of its scores and the bound `length sqrt(max_k |x_k|^2 + |x_i|^2)` (Eq. 4, in one
    neighbourhood).

    Reads: vertex i; rings; halves (3, verts), of `fill_halves`; length, of `length_of`.
    Returns: the divisor, the neighbour of the largest norm, and whether the bound decides.
    """
    start, ring = rings
    squares, most, largest = F(0.0), F(-1.0), ring[start[i]]
    for k in range(start[i], start[i + 1]):
        score = halves[0, i] + halves[1, ring[k]]
        squares += score * score
        if halves[2, ring[k]] > most:
            most, largest = halves[2, ring[k]], ring[k]
    scores, bound = np.sqrt(squares), length * np.sqrt(most + halves[2, i])
    return max(max(scores, bound), MIN_DIVISOR), largest, bound >= scores


@kernel(fastmath=FAST_MATH)
def attend_slab(rings: Rings, halves, length, rule: ScoreRule, attention_out):
    """Computes the attention of each vertex over its ring: the softmax of rectified, normalised scores.

    Reads: rings; halves (3, verts), of `fill_halves`; length, of `length_of`; rule.
    Writes: attention_out (edges,).
    """
    start, ring = rings
    alpha = F(rule.alpha)
    for i in range(start.shape[0] - 1):
        factor = F(1.0)
        if rule.normalised:
            factor = alpha / divisor_at(i, rings, halves, length)[0]
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
def add_gathered(rings: Rings, attention, projected, out):
    """Adds to each vertex the mean of its ring, weighted by attention.

    Reads: rings; attention (edges,); projected (verts, D).
    Writes: out (verts, D): increased.
    """
    start, ring = rings
    width = projected.shape[1]
    for i in range(out.shape[0]):
        row = out[i]
        for k in range(start[i], start[i + 1]):
            weight, other = attention[k], projected[ring[k]]
            for d in range(width):
                row[d] += weight * other[d]


@kernel(inline="always")
def inputs_at(inputs: LayerInputs, frame, head):
    """Takes the inputs of one head of one frame, without a copy.

    Reads: inputs; frame; head.
    Returns: x (verts, F), scale (F,) or empty, extra (verts, L).
    """
    x = inputs.x[min(frame, inputs.x.shape[0] - 1), min(head, inputs.x.shape[1] - 1)]
    return LayerInputs(x, inputs.scale[frame], inputs.extra[frame])


@kernel(inline="always")
def weights_at(weights: LayerWeights, head):
    """Takes the weights of one head, without a copy.

    Reads: weights; head.
    Returns: weights (F, D), extra_weights (L, D), vectors (2, D).
    """
    return LayerWeights(weights.weights[head], weights.extra_weights[head], weights.vectors[head])


@kernel(parallel=True, fastmath=FAST_MATH)
def attend(
    rings: Rings, inputs: LayerInputs, weights: LayerWeights, rule: ScoreRule, keep, memory_out: LayerMemory, out
):
    """Applies a layer: `tanh(mean over the heads of a group of softmax(scores) x weights)`.

    Reads: rings; inputs; weights; rule; keep: whether the memory is kept for `attend_back`.
    Writes: memory_out; out (frames, groups, verts, D).
    """
    frames, groups, count, width = out.shape
    together = weights.vectors.shape[0] // groups
    for unsigned in prange(frames * groups):
        job = np.int64(unsigned)
        frame, group = job // groups, job % groups
        total = out[frame, group]
        total[:] = F(0.0)
        halves = np.empty((3, count), np.float32)
        for head in range(group * together, (group + 1) * together):
            slab = memory_out.slabs[frame, head] if keep else memory_out.slabs[job, 0]
            attention = memory_out.attention[frame, head] if keep else memory_out.attention[job, 0]
            own = weights_at(weights, head)
            project_slab(inputs_at(inputs, frame, head), own, slab)
            fill_halves(slab, own.vectors, halves)
            attend_slab(rings, halves, length_of(own.vectors), rule, attention)
            add_gathered(rings, attention, slab, total)
        share = F(1.0) / F(together)
        for i in range(count):
            for d in range(width):
                total[i, d] = tangent(share * total[i, d])


@kernel(fastmath=FAST_MATH)
def add_gathered_back(rings: Rings, attention, projected, back, attention_back_out, projected_back_out):
    """Computes the backward pass of `add_gathered`.

    Reads: rings; attention (edges,); projected (verts, D); back (verts, D): gradient of its sums.
    Writes: attention_back_out (edges,); projected_back_out (verts, D): increased.
    """
    start, ring = rings
    width = projected.shape[1]
    for i in range(back.shape[0]):
        row = back[i]
        for k in range(start[i], start[i + 1]):
            other, target, weight = projected[ring[k]], projected_back_out[ring[k]], attention[k]
            total = F(0.0)
            for d in range(width):
                total += row[d] * other[d]
                target[d] += weight * row[d]
            attention_back_out[k] = total


@kernel(fastmath=FAST_MATH)
def attend_slab_back(rings: Rings, halves, length, rule: ScoreRule, attention, attention_back, halves_back_out):
    """Computes the backward pass of `attend_slab`.

    Reads: rings, halves, length, rule, as there; attention and its gradient attention_back (edges,).
    Writes: halves_back_out (3, verts).
    Returns: the gradient of length.
    """
    start, ring = rings
    alpha = F(rule.alpha)
    halves_back_out[:] = F(0.0)
    length_back = F(0.0)
    for i in range(start.shape[0] - 1):
        factor, divisor, largest, by_norm = F(1.0), F(1.0), ring[start[i]], False
        if rule.normalised:
            divisor, largest, by_norm = divisor_at(i, rings, halves, length)
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
        if not rule.normalised or divisor <= MIN_DIVISOR:
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
def halves_to_slab_back(projected, vectors, halves_back, length, length_back, projected_back_out, vectors_back_out):
    """Adds the backward pass of `fill_halves` and `length_of`.

    Reads: projected (verts, D); vectors (2, D); length; gradients halves_back (3, verts) and length_back.
    Writes: projected_back_out (verts, D), vectors_back_out (2, D): increased.
    """
    for i in range(projected.shape[0]):
        center, neighbour, square = halves_back[0, i], halves_back[1, i], F(2.0) * halves_back[2, i]
        for d in range(projected.shape[1]):
            value = projected[i, d]
            projected_back_out[i, d] += center * vectors[0, d] + neighbour * vectors[1, d] + square * value
            vectors_back_out[0, d] += center * value
            vectors_back_out[1, d] += neighbour * value
    pull = length_back / max(length, MIN_DIVISOR)
    for half in range(2):
        for d in range(vectors.shape[1]):
            vectors_back_out[half, d] += pull * vectors[half, d]


@kernel(fastmath=FAST_MATH)
def project_slab_back(inputs: LayerInputs, weights: LayerWeights, projected_back, gradients_out: LayerGradients):
    """Adds the backward pass of `project_slab`; the further features are data and get no gradient.

    Reads: inputs, weights, as there; projected_back (verts, D).
    Writes: gradients_out of one head of one frame: scale (F,), weights (F, D), extra_weights (L, D), x (verts, F), or
        without features if no gradient of x is wanted: increased.
    """
    x, scale, extra = inputs
    wanted = gradients_out.x.shape[1] > 0
    if scale.shape[0] > 0:
        raw = np.zeros_like(weights.weights)
        add_product(x.T, projected_back, raw)
        for i in range(raw.shape[0]):
            total = F(0.0)
            for j in range(raw.shape[1]):
                gradients_out.weights[i, j] += scale[i] * raw[i, j]
                total += weights.weights[i, j] * raw[i, j]
            gradients_out.scale[i] += total
        if wanted:
            scaled = np.ascontiguousarray(scale_rows(scale, weights.weights).T)
            add_product(projected_back, scaled, gradients_out.x)
    else:
        add_product(x.T, projected_back, gradients_out.weights)
        if wanted:
            add_product(projected_back, np.ascontiguousarray(weights.weights.T), gradients_out.x)
    if extra.shape[1] > 0:
        add_product(extra.T, projected_back, gradients_out.extra_weights)


@kernel(inline="always")
def gradients_at(gradients: LayerGradients, chunk, frame, head):
    """Takes the gradients of one head of one frame, without a copy.

    Reads: gradients; chunk, in which the frame lies; frame; head.
    Returns: gradients as `project_slab_back` changes them.
    """
    x = gradients.x
    return LayerGradients(
        x[min(chunk, x.shape[0] - 1), min(frame, x.shape[1] - 1), min(head, x.shape[2] - 1)],
        gradients.scale[frame],
        gradients.weights[chunk, head],
        gradients.extra_weights[chunk, head],
        gradients.vectors[chunk, head],
    )


@kernel(parallel=True, fastmath=FAST_MATH)
def attend_back(
    rings: Rings,
    inputs: LayerInputs,
    weights: LayerWeights,
    rule: ScoreRule,
    memory: LayerMemory,
    out,
    back,
    gradients_out: LayerGradients,
):
    """Adds the backward pass of `attend`.

    Reads: rings, inputs, weights, rule and out, as there; memory that it kept; back (frames, groups, verts, D):
        gradient of out.
    Writes: gradients_out: increased; the caller sums the chunks.
    """
    frames, groups, count, width = out.shape
    together, chunks = weights.vectors.shape[0] // groups, gradients_out.vectors.shape[0]
    edge_count = len(rings.ring)
    share = F(1.0) / F(together)
    for unsigned in prange(chunks):
        chunk = np.int64(unsigned)
        halves, halves_back = np.empty((3, count), np.float32), np.empty((3, count), np.float32)
        before, slab_back = np.empty((count, width), np.float32), np.empty((count, width), np.float32)
        attention_back = np.empty(edge_count, np.float32)
        for frame in range(chunk * frames // chunks, (chunk + 1) * frames // chunks):
            for group in range(groups):
                for i in range(count):
                    for d in range(width):
                        value = out[frame, group, i, d]
                        before[i, d] = share * back[frame, group, i, d] * (F(1.0) - value * value)
                for head in range(group * together, (group + 1) * together):
                    slab, attention = memory.slabs[frame, head], memory.attention[frame, head]
                    own, gradients = weights_at(weights, head), gradients_at(gradients_out, chunk, frame, head)
                    length = length_of(own.vectors)
                    slab_back[:] = F(0.0)
                    add_gathered_back(rings, attention, slab, before, attention_back, slab_back)
                    fill_halves(slab, own.vectors, halves)
                    length_back = attend_slab_back(rings, halves, length, rule, attention, attention_back, halves_back)
                    halves_to_slab_back(
                        slab, own.vectors, halves_back, length, length_back, slab_back, gradients.vectors
                    )
                    project_slab_back(inputs_at(inputs, frame, head), own, slab_back, gradients)


@kernel(parallel=True, fastmath=FAST_MATH)
def condense(state, vector, mean_out, scores_out):
    """Condenses all heads of the state to their mean and to the product of each with one vector.

    Reads: state (frames, heads, verts, D); vector (D,).
    Writes: mean_out (frames, verts, D); scores_out (frames, verts, heads).
    """
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
def condense_back(state, vector, mean_back, scores_back, state_back_out, vector_back_out):
    """Computes the backward pass of `condense`.

    Reads: state, vector, as there; mean_back (frames, verts, D); scores_back (frames, verts, heads).
    Writes: state_back_out (frames, heads, verts, D); vector_back_out (frames, D): increased.
    """
    frames, heads, count, width = state.shape
    share = F(1.0) / F(heads)
    for frame in prange(frames):
        total = vector_back_out[frame]
        for head in range(heads):
            for i in range(count):
                row, back, mean = state[frame, head, i], state_back_out[frame, head, i], mean_back[frame, i]
                pull = scores_back[frame, i, head]
                for d in range(width):
                    back[d] = pull * vector[d] + share * mean[d]
                    total[d] += pull * row[d]
