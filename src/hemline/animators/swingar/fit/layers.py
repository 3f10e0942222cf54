"""Graph attention layers with Lipschitz-normalised scores (GAT-LN), for training."""

from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
import torch
from torch import Tensor, nn

from hemline.animators.swingar.graph import Graph
from hemline.animators.swingar.kernel_inputs import LayerGradients, LayerInputs, LayerMemory, LayerWeights, ScoreRule
from hemline.animators.swingar.layer_kernels import (
    LEAKY_SLOPE,
    MIN_DIVISOR,
    attend,
    attend_back,
    condense,
    condense_back,
)
from hemline.compiled import threads
from hemline.errors import BadInput


def _arrays(*tensors: Tensor) -> list[np.ndarray]:
    """Returns the contents of tensors on the processor, contiguous, without a copy where they are so already."""
    return [each.detach().contiguous().numpy() for each in tensors]


class _Attention(torch.autograd.Function):
    """Makes `layer_kernels.attend` differentiable."""

    @staticmethod
    def forward(
        ctx: Any,
        graph: Graph,
        x: Tensor,
        scale: Tensor,
        weights: Tensor,
        extra: Tensor,
        extra_weights: Tensor,
        vectors: Tensor,
        groups: int,
        alpha: float | None,
    ) -> Tensor:
        frames, count, heads = max(len(x), len(scale), len(extra)), x.shape[2], len(weights)
        scale = scale if len(scale) else scale.new_zeros((frames, 0))
        extra = extra if len(extra) else extra.new_zeros((frames, count, 0))
        keep = any(ctx.needs_input_grad)
        jobs = (frames, heads) if keep else (frames * groups, 1)
        slabs = torch.empty((*jobs, count, weights.shape[2]))
        attention = torch.empty((*jobs, len(graph.ring)))
        out = torch.empty((frames, groups, count, weights.shape[2]))
        inputs, rule = (
            LayerInputs(*_arrays(x, scale, extra)),
            ScoreRule(0.0 if alpha is None else alpha, alpha is not None),
        )
        parameters, memory = LayerWeights(*_arrays(weights, extra_weights, vectors)), _arrays(slabs, attention)
        attend(graph.rings, inputs, parameters, rule, keep, LayerMemory(*memory), out.numpy())
        ctx.save_for_backward(x, scale, weights, extra, extra_weights, vectors, slabs, attention, out)
        ctx.graph, ctx.rule = graph, rule
        return out

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        x, scale, weights, extra, extra_weights, vectors, slabs, attention, out = ctx.saved_tensors
        wanted, scaled = ctx.needs_input_grad[1], scale.shape[1] > 0
        chunks = min(threads(), len(out))
        each = weights, extra_weights, vectors
        weights_back, extra_back, vectors_back = (torch.zeros((chunks, *part.shape)) for part in each)
        x_back = torch.zeros((chunks if len(x) == 1 else 1, *x.shape)) if wanted else torch.zeros((1, 1, 1, 0, 0))
        scale_back = torch.zeros_like(scale)
        inputs, parameters = (
            LayerInputs(*_arrays(x, scale, extra)),
            LayerWeights(*_arrays(weights, extra_weights, vectors)),
        )
        gradients = LayerGradients(*_arrays(x_back, scale_back, weights_back, extra_back, vectors_back))
        memory = LayerMemory(*_arrays(slabs, attention))
        attend_back(ctx.graph.rings, inputs, parameters, ctx.rule, memory, *_arrays(out, backs[0]), gradients)
        return (
            None,
            x_back.sum(0) if wanted else None,
            scale_back if scaled else None,
            weights_back.sum(0),
            None,
            extra_back.sum(0),
            vectors_back.sum(0),
            None,
            None,
        )


class _CondenseHeads(torch.autograd.Function):
    """Makes `layer_kernels.condense` differentiable."""

    @staticmethod
    def forward(ctx: Any, state: Tensor, vector: Tensor) -> tuple[Tensor, Tensor]:
        frames, heads, count, width = state.shape
        mean, scores = torch.empty((frames, count, width)), torch.empty((frames, count, heads))
        condense(state.detach().numpy(), vector.detach().numpy(), mean.numpy(), scores.numpy())
        ctx.save_for_backward(state, vector)
        return mean, scores

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        state, vector = ctx.saved_tensors
        state_back, vector_back = torch.empty_like(state), torch.zeros((len(state), len(vector)))
        condense_back(*_arrays(state, vector, *backs), state_back.numpy(), vector_back.numpy())
        return state_back, vector_back.sum(0)


def condense_heads(state: Tensor, vector: Tensor) -> tuple[Tensor, Tensor]:
    """Computes the mean of all heads, and the product of each head with one vector.

    Args:
        state: Features (frames, heads, verts, width), contiguous.
        vector: The vector (width,).

    Returns:
        Mean (frames, verts, width), products (frames, verts, heads).
    """
    if state.device.type != "cpu":
        return state.mean(1), (state @ vector).transpose(1, 2)
    return _CondenseHeads.apply(state, vector)


class GatLn(nn.Module):
    r"""Graph attention with Lipschitz-normalised scores.

    Head $h$ projects features to $x'_i = W_h x_i$ and gives vertex $i$ the sum of $a_{ij} x'_j$ over its ring, itself
    included, where $a_{ij}$ is the softmax over $j$ of the leaky rectifier of

    $$\alpha\, e_{ij} / \max\big(\lVert e_{i\cdot} \rVert,\;
      \lVert a_h \rVert \sqrt{\max_k \lvert x'_k \rvert^2 + \lvert x'_i \rvert^2}\big),
      \qquad e_{ij} = a_h^{(1)} \cdot x'_i + a_h^{(2)} \cdot x'_j$$

    The outputs are $\tanh$ of the mean of such sums over the heads of a group. Thus $\lvert\text{score}\rvert \le
    \alpha$ for features of any size, and `alpha=0` gives the mean of the ring. Weights are drawn, head by head, as in
    Glorot and Bengio 2010.

    Args:
        inputs: Width of the features.
        outputs: Width of the result, per head.
        heads: Number of all heads.
        groups: Number of results; the heads of one are averaged. By default the heads stay separate.
        alpha: Scale of the scores; None does not normalise them (ordinary graph attention).
        extra: Width of further features of each vertex, which all heads are given.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Eq. 2 and 4; Velickovic et al., "Graph attention networks", 2018,
        Eq. 1 to 6 (also: heads are averaged before the nonlinearity); Dasoulas, Scaman, Virmaux, "Lipschitz
        Normalization for Self-Attention Layers with Application to Graph Neural Networks", 2021.
    Differs: norms are taken over each neighbourhood, not over the whole graph, and per head.
    """

    def __init__(
        self, inputs: int, outputs: int, heads: int, *, groups: int | None = None, alpha: float | None, extra: int = 0
    ):
        super().__init__()
        self.groups, self.alpha = groups or heads, alpha
        self.weights = nn.Parameter(torch.empty(heads, inputs, outputs))
        self.extra_weights = nn.Parameter(torch.empty(heads, extra, outputs))
        self.vectors = nn.Parameter(torch.empty(heads, 2, outputs))
        for head in range(heads):
            nn.init.xavier_uniform_(self.weights[head])
            nn.init.xavier_uniform_(self.vectors[head])
            if extra:
                nn.init.xavier_uniform_(self.extra_weights[head])

    def forward(self, graph: Graph, x: Tensor, *, scale: Tensor | None = None, extra: Tensor | None = None) -> Tensor:
        """Applies the layer to the features of all vertices in some frames.

        Args:
            graph: Graph of the garment.
            x: Features (frames, heads, verts, inputs); an axis of length 1 is used for all frames or heads.
            scale: Factors of the features (frames, inputs); None for 1.
            extra: Further features (frames, verts, extra), which get no gradient; None for none.

        Returns:
            Features (frames, groups, verts, outputs), each between -1 and 1.

        Raises:
            BadInput: The number of further features is another than that of the layer.
        """
        wanted = self.extra_weights.shape[1]
        if extra is not None and extra.shape[-1] != wanted:
            got = f"{extra.shape[-1]} of a vertex"
            raise BadInput(f"a layer made for {wanted} further features", got, "give as many, or none")
        if x.device.type != "cpu":
            return gather_attention(self, graph, x, scale, extra)
        scale = x.new_zeros((0, 0)) if scale is None else scale
        extra = x.new_zeros((0, x.shape[2], 0)) if extra is None else extra
        return _Attention.apply(
            graph, x, scale, self.weights, extra, self.extra_weights, self.vectors, self.groups, self.alpha
        )


@dataclass(frozen=True, eq=False)
class _Rings:
    """`Graph.equal_rings` on a device."""

    ring: Tensor
    """Vertices of each ring (verts, slots)."""
    real: Tensor
    """1 for a vertex of the ring, 0 for a slot that is left over (verts, slots)."""
    back: Tensor
    """Number of the slot, of all, in which the vertex of a slot has this slot's vertex (verts, slots)."""
    vertices: Tensor
    """`ring`, -1 for a slot that is left over, int32."""
    back_slots: Tensor
    """`back`, -1 for a slot that is left over, int32."""

    @classmethod
    def of(cls, graph: Graph, device: torch.device) -> "_Rings":
        """Copies the rings of a graph to a device, once."""
        copies = _copies.setdefault(graph, {})
        if device not in copies:
            ring, real = graph.equal_rings
            rows, slots = np.nonzero(real)
            columns = ring[rows, slots]
            order = np.lexsort((rows, columns))  # the pairs of vertices are the same in either order
            back = np.zeros(ring.shape, np.int64)
            back[rows, slots] = (rows * ring.shape[1] + slots)[order]
            parts = ring, real, back, np.where(real > 0, ring, -1), np.where(real > 0, back, -1)
            ring_at, real_at, back_at, *compiled = (torch.from_numpy(each).to(device) for each in parts)
            copies[device] = cls(ring_at, real_at, back_at, *(each.int() for each in compiled))
        return copies[device]


_copies: WeakKeyDictionary[Graph, dict[torch.device, _Rings]] = WeakKeyDictionary()


class _Spread(torch.autograd.Function):
    """Gives each slot of a ring the value of its vertex, and 0 to slots that are left over.

    What autograd would make of the indexing adds up gradients in random order, and slowly. Since neighbours are
    neighbours of each other, the gradient of a vertex is found in its own ring.
    """

    @staticmethod
    def forward(ctx: Any, values: Tensor, rings: _Rings) -> Tensor:
        ctx.rings = rings
        return values[..., rings.ring] * rings.real

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        rings = ctx.rings
        return (backs[0].flatten(-2)[..., rings.back] * rings.real).sum(-1), None


class _SumOverRings(torch.autograd.Function):
    """Sums up the features of each ring, weighted by attention; `_Spread` tells why it has a backward of its own."""

    @staticmethod
    def forward(ctx: Any, attention: Tensor, features: Tensor, rings: _Rings) -> Tensor:
        ctx.save_for_backward(attention, features)
        ctx.rings = rings
        return (attention[..., None, :] @ features[:, :, rings.ring])[..., 0, :]

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        attention, features = ctx.saved_tensors
        rings, back = ctx.rings, backs[0]
        attention_back = (features[:, :, rings.ring] @ back[..., None])[..., 0]
        turned = attention.flatten(-2)[..., rings.back] * rings.real
        return attention_back, (turned[..., None, :] @ back[:, :, rings.ring])[..., 0, :], None


@cache
def has_triton() -> bool:
    """Tells whether Triton is here, which torch brings in its CUDA builds for Linux."""
    return find_spec("triton") is not None


def is_compiled_on(device: torch.device) -> bool:
    """Tells whether Triton compiles the attention for a device."""
    return device.type == "cuda" and has_triton()


class _Add(torch.autograd.Function):
    """Adds two tensors of any strides into one that is contiguous, which saves a copy of the sum."""

    @staticmethod
    def forward(ctx: Any, one: Tensor, other: Tensor) -> Tensor:
        ctx.shapes = one.shape, other.shape
        return torch.add(one, other, out=one.new_empty(torch.broadcast_shapes(*ctx.shapes)))

    @staticmethod
    def backward(ctx: Any, *backs: Tensor) -> Any:
        return tuple(backs[0].sum_to_size(shape) for shape in ctx.shapes)


def _project(layer: GatLn, x: Tensor, scale: Tensor | None, extra: Tensor | None) -> Tensor:
    """Returns the projected features of each head, their products with the two vectors of the layer, and zeros up to a
    multiple of four columns (frames, heads, verts, columns), contiguous."""

    def with_products(weights: Tensor) -> Tensor:
        """Appends the products as two columns, so that one large product makes all of them, and then zeros, so that
        rows begin at multiples of 16 bytes."""
        products = weights @ layer.vectors.transpose(1, 2)
        nothing = weights.new_zeros((*weights.shape[:2], -(weights.shape[2] + 2) % 4))
        return torch.cat([weights, products, nothing], dim=2)

    weights = with_products(layer.weights)
    heads, inputs, outputs = weights.shape
    if scale is not None and len(x) == 1 and x.shape[1] == heads:
        # all frames share the features: their weights are scaled instead, side by side in one product
        scaled = (weights[:, :, None] * scale.T[:, :, None]).reshape(heads, inputs, -1)
        projected = (x[0] @ scaled).unflatten(-1, (len(scale), outputs)).permute(2, 0, 1, 3)
    else:
        projected = (x if scale is None else x * scale[:, None, None, :]) @ weights
    if extra is not None and extra.shape[-1]:
        joined = extra @ with_products(layer.extra_weights).transpose(0, 1).reshape(-1, heads * outputs)
        return _Add.apply(projected, joined.unflatten(-1, (heads, outputs)).transpose(1, 2))
    return projected.contiguous()


def gather_attention(
    layer: GatLn, graph: Graph, x: Tensor, scale: Tensor | None = None, extra: Tensor | None = None
) -> Tensor:
    """Applies a layer on rings of equal length, by Triton where it is, otherwise in plain torch.

    Args:
        layer: The layer.
        graph: Graph of the garment.
        x: Features (frames, heads, verts, inputs); an axis of length 1 is used for all frames or heads.
        scale: Factors of the features (frames, inputs); None for 1.
        extra: Further features (frames, verts, extra); None for none.

    Returns:
        Features (frames, groups, verts, outputs), each between -1 and 1.
    """
    rings, width = _Rings.of(graph, x.device), layer.weights.shape[2]
    table = _project(layer, x, scale, extra)
    lengths = layer.vectors.square().sum((1, 2)).sqrt()
    if is_compiled_on(x.device):
        from .ring_attention import RingAttention

        alone = layer.groups == len(layer.weights)
        gathered = RingAttention.apply(table, lengths, rings.vertices, rings.back_slots, width, layer.alpha, alone)
        return gathered if alone else torch.tanh(gathered.unflatten(1, (layer.groups, -1)).mean(2))
    projected, center, neighbour = table[..., :width], table[..., width], table[..., width + 1]
    scores = center[..., None] * rings.real + _Spread.apply(neighbour, rings)
    if layer.alpha is not None:
        squares = torch.linalg.vector_norm(projected, dim=-1).square()
        bound = lengths[:, None] * (_Spread.apply(squares, rings).amax(-1) + squares).sqrt()
        norms = scores.square().sum(-1).sqrt()
        scores = layer.alpha * scores / torch.maximum(norms, bound).clamp(min=float(MIN_DIVISOR))[..., None]
    scores = torch.nn.functional.leaky_relu(scores, float(LEAKY_SLOPE)).masked_fill(rings.real == 0, -torch.inf)
    gathered = _SumOverRings.apply(scores.softmax(-1), projected, rings)
    return torch.tanh(gathered.unflatten(1, (layer.groups, -1)).mean(2))
