"""Attention over the rings of a graph on a GPU, compiled by Triton: scores, softmax and sum in one pass."""

from typing import Any

import torch
import triton  # pyright: ignore[reportMissingImports]
import triton.language as tl  # pyright: ignore[reportMissingImports]
from torch import Tensor

from hemline.animators.swingar.layer_kernels import LEAKY_SLOPE, MIN_DIVISOR

TILE = 4096
"""Numbers that one program holds at once: vertices, times slots of a ring, times width. All three are powers of 2."""
WARPS = 4
"""Groups of 32 threads of one program."""
_MOST_VERTS = 32
_SLOPE = tl.constexpr(float(LEAKY_SLOPE))
_LEAST = tl.constexpr(float(MIN_DIVISOR))
_FEW = tl.constexpr(0.25)
_VARIABLE = ["heads", "count", "most"]


@triton.jit
def _tangent(x):
    """Computes the hyperbolic tangent, near 0 by the first terms of its series, within 3e-7."""
    s = x * x
    near = x * (1 + s * (-1 / 3 + s * (2 / 15 + s * (-17 / 315 + s * (62 / 2835)))))
    far = 1 - 2 / (tl.exp(2 * tl.minimum(tl.abs(x), 20.0)) + 1)
    return tl.where(tl.abs(x) < _FEW, near, tl.where(x < 0, -far, far))


@triton.jit
def _place(ring, count, most, verts: tl.constexpr, slots: tl.constexpr):
    """Finds the vertices of this program, and their rings.

    Reads: ring (count, most), int32, -1 for a slot that is left over.
    Returns: batch, int64; vertices (verts,), the last one again beyond it, and whether each is no such repetition;
        numbers of the slots (verts, slots), vertices there, 0 for a slot that is left over, and whether it is not.
    """
    blocks = tl.cdiv(count, verts)
    batch = (tl.program_id(0) // blocks).to(tl.int64)
    raw = (tl.program_id(0) % blocks) * verts + tl.arange(0, verts)
    vertex = tl.minimum(raw, count - 1)
    k = tl.arange(0, slots)[None, :]
    slot = vertex[:, None] * most + k
    other = tl.load(ring + slot, mask=k < most, other=-1)
    return batch, vertex, raw < count, slot, tl.maximum(other, 0), other >= 0


@triton.jit
def _attend(projected, squares, length, alpha, rows, others, real, stride: tl.constexpr, width: tl.constexpr,
            normalised: tl.constexpr):  # fmt: skip
    """Computes the attention of some vertices over their rings.

    Reads: projected (rows, stride), the features, the score as center, and the score as neighbour; squares (rows,) of
        the norms of the features; length of the vectors of the head; alpha; rows of the vertices (verts,) and of their
        neighbours (verts, slots); whether each slot is real.
    Returns: attention, normalised scores and scores, all (verts, slots); divisor, norm of the scores, its bound, and
        the root in the bound, all (verts,); squares of the norms of the neighbours (verts, slots).
    """
    center = tl.load(projected + rows * stride + width)
    neighbour = tl.load(projected + others * stride + (width + 1), mask=real, other=0.0)
    raw = tl.where(real, center[:, None] + neighbour, 0.0)
    if normalised:
        around = tl.load(squares + others, mask=real, other=0.0)
        root = tl.sqrt(tl.max(around, axis=1) + tl.load(squares + rows))
        norm = tl.sqrt(tl.sum(raw * raw, axis=1))
        bound = length * root
        divisor = tl.maximum(tl.maximum(norm, bound), _LEAST)
        scores = alpha * raw / divisor[:, None]
    else:
        around, root, norm, bound, divisor, scores = raw, center, center, center, center, raw
    rectified = tl.where(real, tl.where(scores > 0, scores, _SLOPE * scores), float("-inf"))
    grown = tl.exp(rectified - tl.max(rectified, axis=1)[:, None])
    attention = grown / tl.sum(grown, axis=1)[:, None]
    return attention, scores, raw, divisor, norm, bound, root, around


@triton.jit(do_not_specialize=["total"])
def _square_kernel(projected, squares_out, total, stride: tl.constexpr, width: tl.constexpr, verts: tl.constexpr,
                   block: tl.constexpr):  # fmt: skip
    """Computes the squares of the norms of all features.

    Reads: projected (total, stride), the features and further columns.
    Writes: squares_out (total,).
    """
    row = tl.program_id(0).to(tl.int64) * verts + tl.arange(0, verts)
    column = tl.arange(0, block)[None, :]
    held = (row < total)[:, None] & (column < width)
    features = tl.load(projected + row[:, None] * stride + column, mask=held, other=0.0)
    tl.store(squares_out + row, tl.sum(features * features, axis=1), mask=row < total)


@triton.jit(do_not_specialize=_VARIABLE)
def _forward_kernel(projected, squares, lengths, ring, out, alpha, heads, count, most, normalised: tl.constexpr,
                    closed: tl.constexpr, stride: tl.constexpr, width: tl.constexpr, verts: tl.constexpr,
                    slots: tl.constexpr, block: tl.constexpr):  # fmt: skip
    """Sums up the features of each ring, weighted by attention.

    Reads: projected (frames, heads, count, stride), see `_attend`; squares (frames, heads, count); lengths (heads,);
        ring (count, most), see `_place`; alpha.
    Writes: out (frames, heads, count, width), the sums, or their hyperbolic tangents if `closed`.
    """
    batch, vertex, inside, _, other, real = _place(ring, count, most, verts, slots)
    rows, others = batch * count + vertex, batch * count + other
    length = tl.load(lengths + batch % heads)
    attention, _, _, _, _, _, _, _ = _attend(
        projected, squares, length, alpha, rows, others, real, stride, width, normalised
    )
    column = tl.arange(0, block)
    held = real[:, :, None] & (column < width)[None, None, :]
    features = tl.load(projected + others[:, :, None] * stride + column[None, None, :], mask=held, other=0.0)
    total = tl.sum(attention[:, :, None] * features, axis=1)
    if closed:
        total = _tangent(total)
    kept = inside[:, None] & (column < width)[None, :]
    tl.store(out + rows[:, None] * width + column[None, :], total, mask=kept)


@triton.jit(do_not_specialize=_VARIABLE)
def _score_kernel(projected, squares, lengths, ring, closing, out, given, attention_out, score_out, square_out,
                  length_out, alpha, heads, count, most, normalised: tl.constexpr, closed: tl.constexpr,
                  stride: tl.constexpr, width: tl.constexpr, verts: tl.constexpr, slots: tl.constexpr,
                  block: tl.constexpr):  # fmt: skip
    """Computes the attention once more, and the gradients of what each slot contributes to it.

    Reads: what `_forward_kernel` reads; out, which it wrote; closing, the gradient of out.
    Writes: given (frames, heads, count, width), the gradient of the sums, if `closed`, else it is `closing`;
        attention_out and score_out (frames, heads, count, most), attention and gradient of the scores; if
        `normalised`, square_out (frames, heads, count, most), gradient of the squares by way of each slot, and
        length_out (frames, heads, count), gradient of the length by way of each vertex.
    """
    batch, vertex, inside, slot, other, real = _place(ring, count, most, verts, slots)
    rows, others = batch * count + vertex, batch * count + other
    length = tl.load(lengths + batch % heads)
    attention, scores, raw, divisor, norm, bound, root, around = _attend(
        projected, squares, length, alpha, rows, others, real, stride, width, normalised
    )
    column = tl.arange(0, block)
    kept = inside[:, None] & (column < width)[None, :]
    at = rows[:, None] * width + column[None, :]
    back = tl.load(closing + at, mask=kept, other=0.0)
    if closed:
        tangent = tl.load(out + at, mask=kept, other=0.0)
        back = back * (1 - tangent * tangent)
        tl.store(given + at, back, mask=kept)
    held = real[:, :, None] & (column < width)[None, None, :]
    features = tl.load(projected + others[:, :, None] * stride + column[None, None, :], mask=held, other=0.0)
    attention_back = tl.sum(features * back[:, None, :], axis=2)
    mean = tl.sum(attention * attention_back, axis=1)
    score_back = attention * (attention_back - mean[:, None]) * tl.where(scores > 0, 1.0, _SLOPE)
    stored = inside[:, None] & (tl.arange(0, slots)[None, :] < most)
    at = batch * count * most + slot
    if normalised:
        divisor_back = -tl.sum(score_back * scores, axis=1) / divisor
        score_back = alpha * score_back / divisor[:, None]
        divisor_back = tl.where(divisor > _LEAST, divisor_back, 0.0)
        by_norm = tl.where(bound >= norm, 0.0, divisor_back / divisor)
        score_back += by_norm[:, None] * raw
        by_bound = tl.where(bound >= norm, divisor_back, 0.0)
        tl.store(length_out + rows, by_bound * root, mask=inside)
        square_back = by_bound * length / (2 * tl.where(root > 0, root, 1.0))
        k = tl.arange(0, slots)[None, :]
        largest = real & (around == tl.max(around, axis=1)[:, None])
        first = tl.min(tl.where(largest, k, slots), axis=1)
        times = tl.where(k == first[:, None], 1.0, 0.0) + tl.where(real & (other == vertex[:, None]), 1.0, 0.0)
        tl.store(square_out + at, square_back[:, None] * times, mask=stored)
    tl.store(attention_out + at, attention, mask=stored)
    tl.store(score_out + at, tl.where(real, score_back, 0.0), mask=stored)


@triton.jit(do_not_specialize=_VARIABLE[1:])
def _backward_kernel(projected, ring, back, given, attention, score_back, square_back, projected_out, count, most,
                     normalised: tl.constexpr, stride: tl.constexpr, width: tl.constexpr, verts: tl.constexpr,
                     slots: tl.constexpr, block: tl.constexpr):  # fmt: skip
    """Collects the gradients of each vertex from the rings that hold it, which are those of its own ring.

    Reads: projected; ring; back (count, most), number of the slot in which the vertex of a slot has this slot's vertex;
        given, attention, score_back, square_back, which `_score_kernel` wrote.
    Writes: projected_out (frames, heads, count, stride), the gradient of projected.
    """
    batch, vertex, inside, slot, other, real = _place(ring, count, most, verts, slots)
    rows, others = batch * count + vertex, batch * count + other
    turned = batch * count * most + tl.load(back + slot, mask=real, other=0)
    column = tl.arange(0, block)
    held = real[:, :, None] & (column < width)[None, None, :]
    closing = tl.load(given + others[:, :, None] * width + column[None, None, :], mask=held, other=0.0)
    share = tl.load(attention + turned, mask=real, other=0.0)
    total = tl.sum(share[:, :, None] * closing, axis=1)
    kept = inside[:, None] & (column < width)[None, :]
    at = rows[:, None] * stride
    if normalised:
        factor = 2 * tl.sum(tl.load(square_back + turned, mask=real, other=0.0), axis=1)
        total += factor[:, None] * tl.load(projected + at + column[None, :], mask=kept, other=0.0)
    tl.store(projected_out + at + column[None, :], total, mask=kept)
    center = tl.sum(tl.load(score_back + batch * count * most + slot, mask=real, other=0.0), axis=1)
    neighbour = tl.sum(tl.load(score_back + turned, mask=real, other=0.0), axis=1)
    last = tl.arange(0, 8)[None, :]
    ends = tl.where(last == 0, center[:, None], tl.where(last == 1, neighbour[:, None], 0.0))
    tl.store(projected_out + at + width + last, ends, mask=inside[:, None] & (width + last < stride))


class RingAttention(torch.autograd.Function):
    """Sums up the features of each ring, weighted by attention.

    Neighbours are neighbours of each other: the gradient of a vertex is found in its own ring, without atomic
    additions, so that equal input gives equal bits. What can be computed once more from the features is not kept.
    """

    @staticmethod
    def forward(
        ctx: Any,
        projected: Tensor,
        lengths: Tensor,
        ring: Tensor,
        back: Tensor,
        width: int,
        alpha: float | None,
        closed: bool,
    ) -> Tensor:
        """Computes scores and attention, and sums up.

        Args:
            ctx: Context of torch.
            projected: Features, score as center, score as neighbour, and at most six columns of no meaning (frames,
                heads, verts, columns), float32, contiguous.
            lengths: Norm of both vectors of scores together (heads,), float32.
            ring: Vertices of each ring, -1 for a slot that is left over (verts, slots), int32.
            back: Number of the slot in which the vertex of a slot has this slot's vertex (verts, slots), int32.
            width: Number of features.
            alpha: Scale of the scores; None does not normalise them.
            closed: Whether to return hyperbolic tangents of the sums.

        Returns:
            Sums or their tangents (frames, heads, verts, width).
        """
        frames, heads, count, stride = projected.shape
        out = projected.new_empty((frames, heads, count, width))
        squares = _squares(projected, width) if alpha is not None else lengths
        grid, *sizes = _sizes(ring, frames * heads, width)
        _forward_kernel[grid](  # pyright: ignore[reportIndexIssue]
            projected, squares, lengths, ring, out, alpha or 0.0, heads, count, ring.shape[1],
            alpha is not None, closed, stride, width, *sizes, num_warps=WARPS,
        )  # fmt: skip
        ctx.save_for_backward(projected, squares, lengths, ring, back, *([out] if closed else []))
        ctx.rule = width, alpha, closed
        return out

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        """Returns the gradients of projected and lengths."""
        projected, squares, lengths, ring, back, *outs = ctx.saved_tensors
        width, alpha, closed = ctx.rule
        frames, heads, count, stride = projected.shape
        normalised, most, closing = alpha is not None, ring.shape[1], backs[0].contiguous()
        given = torch.empty_like(closing) if closed else closing
        attention, score_back = (projected.new_empty((frames, heads, count, most)) for _ in range(2))
        square_back = torch.empty_like(score_back) if normalised else score_back
        length_back = projected.new_empty((frames, heads, count)) if normalised else score_back
        projected_back = torch.empty_like(projected)
        grid, *sizes = _sizes(ring, frames * heads, width)
        _score_kernel[grid](  # pyright: ignore[reportIndexIssue]
            projected, squares, lengths, ring, closing, outs[0] if closed else closing, given, attention, score_back,
            square_back, length_back, alpha or 0.0, heads, count, most,
            normalised, closed, stride, width, *sizes, num_warps=WARPS,
        )  # fmt: skip
        _backward_kernel[grid](  # pyright: ignore[reportIndexIssue]
            projected, ring, back, given, attention, score_back, square_back, projected_back, count, most,
            normalised, stride, width, *sizes, num_warps=WARPS,
        )  # fmt: skip
        return projected_back, length_back.sum((0, 2)) if normalised else None, None, None, None, None, None


def _squares(projected: Tensor, width: int) -> Tensor:
    """Returns the squares of the norms of all features (frames, heads, verts)."""
    squares = projected.new_empty(projected.shape[:-1])
    block = triton.next_power_of_2(max(width, 4))
    verts = min(max(TILE // 2 // block, 1), 128)
    _square_kernel[(triton.cdiv(squares.numel(), verts),)](  # pyright: ignore[reportIndexIssue]
        projected, squares, squares.numel(), projected.shape[-1], width, verts, block, num_warps=WARPS
    )
    return squares


def _sizes(ring: Tensor, batches: int, width: int) -> tuple[tuple[int], int, int, int]:
    """Returns the number of programs, and how many vertices, slots and columns one has room for."""
    count, most = ring.shape
    slots, block = (triton.next_power_of_2(max(each, least)) for each, least in ((most, 2), (width, 4)))
    verts = min(max(TILE // (slots * block), 1), _MOST_VERTS)
    return (batches * triton.cdiv(count, verts),), verts, slots, block
