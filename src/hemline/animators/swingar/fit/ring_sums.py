"""Sums over the rings of a graph on a GPU, compiled by Triton, without copies of the features of neighbours."""

from typing import Any

import torch
import triton  # pyright: ignore[reportMissingImports]
import triton.language as tl  # pyright: ignore[reportMissingImports]
from torch import Tensor

VERTS = tl.constexpr(16)
"""Vertices of one program."""


@triton.jit(do_not_specialize=["count", "stride", "most"])
def _sum_kernel(features, weights, ring, slots, out, count, stride, most, width: tl.constexpr, block: tl.constexpr):
    """Writes the sum over k of weights[b, slots[v, k]] features[b, ring[v, k]] to out[b, v]; a slot of -1 is none."""
    verts = tl.program_id(0) * VERTS + tl.arange(0, VERTS)
    batch, columns = tl.program_id(1).to(tl.int64), tl.arange(0, block)
    inside = verts < count
    total = tl.zeros((VERTS, block), tl.float32)
    for k in range(most):
        other = tl.load(ring + verts * most + k, mask=inside, other=0)
        slot = tl.load(slots + verts * most + k, mask=inside, other=-1)
        weight = tl.load(weights + batch * count * most + slot, mask=inside & (slot >= 0), other=0.0)
        at = features + (batch * count + other[:, None]) * stride + columns[None, :]
        total += weight[:, None] * tl.load(at, mask=inside[:, None] & (columns[None, :] < width), other=0.0)
    at = out + (batch * count + verts[:, None]) * width + columns[None, :]
    tl.store(at, total, mask=inside[:, None] & (columns[None, :] < width))


@triton.jit(do_not_specialize=["count", "stride", "most"])
def _product_kernel(features, backs, ring, out, count, stride, most, width: tl.constexpr, block: tl.constexpr):
    """Writes the product of features[b, ring[v, k]] and backs[b, v] to out[b, v, k]."""
    verts = tl.program_id(0) * VERTS + tl.arange(0, VERTS)
    batch, columns = tl.program_id(1).to(tl.int64), tl.arange(0, block)
    inside = verts < count
    held = inside[:, None] & (columns[None, :] < width)
    back = tl.load(backs + (batch * count + verts[:, None]) * width + columns[None, :], mask=held, other=0.0)
    for k in range(most):
        other = tl.load(ring + verts * most + k, mask=inside, other=0)
        at = features + (batch * count + other[:, None]) * stride + columns[None, :]
        product = tl.sum(back * tl.load(at, mask=held, other=0.0), axis=1)
        tl.store(out + (batch * count + verts) * most + k, product, mask=inside)


class SumOverRings(torch.autograd.Function):
    """Sums up the features of each ring, weighted by attention.

    Neighbours are neighbours of each other: the gradient of a vertex is found in its own ring, by the same kernel.
    """

    @staticmethod
    def forward(ctx: Any, attention: Tensor, features: Tensor, ring: Tensor, own: Tensor, back: Tensor) -> Tensor:
        """Sums up.

        Args:
            ctx: Context of torch.
            attention: Weights (frames, heads, verts, slots).
            features: Features (frames, heads, verts, width), whose rows may lie apart.
            ring: Vertices of each ring (verts, slots), int32.
            own: Number of each slot, -1 for one that is left over (verts, slots), int32.
            back: Number of the slot in which the vertex of a slot has this slot's vertex, or -1, int32.
        """
        attention = attention.contiguous()
        ctx.save_for_backward(attention, features, ring, back)
        return _sum(features, features.stride(-2), attention, ring, own)

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        """Returns the gradients of attention and features."""
        attention, features, ring, back = ctx.saved_tensors
        given = backs[0].contiguous()
        attention_back = torch.empty_like(attention)
        count, width = features.shape[-2:]
        grid = (triton.cdiv(count, VERTS.value), attention.shape[0] * attention.shape[1])
        sizes = width, max(triton.next_power_of_2(width), 16)
        _product_kernel[grid](  # pyright: ignore[reportIndexIssue]
            features, given, ring, attention_back, count, features.stride(-2), ring.shape[1], *sizes
        )
        return attention_back, _sum(given, width, attention, ring, back), None, None, None


def _sum(features: Tensor, stride: int, weights: Tensor, ring: Tensor, slots: Tensor) -> Tensor:
    frames, heads, count, width = features.shape
    out = torch.empty((frames, heads, count, width), device=features.device)
    grid = (triton.cdiv(count, VERTS.value), frames * heads)
    sizes = width, max(triton.next_power_of_2(width), 16)
    _sum_kernel[grid](  # pyright: ignore[reportIndexIssue]
        features, weights, ring, slots, out, count, stride, ring.shape[1], *sizes
    )
    return out
