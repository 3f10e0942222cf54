"""Graph attention layers with Lipschitz-normalised scores (GAT-LN), for training."""

from typing import Any
from weakref import WeakKeyDictionary

import torch
from torch import Tensor, nn

from hemline.animators.swingar.graph import Graph
from hemline.animators.swingar.layer_kernels import SLOPE, TINY, attend, attend_back, condense, condense_back
from hemline.compiled import threads
from hemline.errors import BadInput


class _Attention(torch.autograd.Function):
    """`layer_kernels.attend` and its backward."""

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
        given = [each.detach().contiguous().numpy() for each in (x, scale, weights, extra, extra_weights, vectors)]
        options = 0.0 if alpha is None else alpha, alpha is not None
        attend(graph.start, graph.ring, *given, *options, keep, slabs.numpy(), attention.numpy(), out.numpy())
        ctx.save_for_backward(x, scale, weights, extra, extra_weights, vectors, slabs, attention, out)
        ctx.graph, ctx.options = graph, options
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
        given = [part.detach().contiguous().numpy() for part in (x, scale, weights, extra, vectors)]
        kept = [part.detach().contiguous().numpy() for part in (slabs, attention, out, backs[0])]
        backs_out = [part.numpy() for part in (scale_back, weights_back, extra_back, vectors_back, x_back)]
        attend_back(ctx.graph.start, ctx.graph.ring, *given, *ctx.options, wanted, *kept, *backs_out)
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


class _Condensed(torch.autograd.Function):
    """`layer_kernels.condense` and its backward."""

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
        given = [each.detach().contiguous().numpy() for each in (state, vector, *backs)]
        condense_back(*given, state_back.numpy(), vector_back.numpy())
        return state_back, vector_back.sum(0)


def condensed(state: Tensor, vector: Tensor) -> tuple[Tensor, Tensor]:
    """The mean of heads, and the product of each head with one vector.

    Args:
        state: Features (frames, heads, verts, width), contiguous.
        vector: (width,).

    Returns:
        Mean (frames, verts, width), products (frames, verts, heads).
    """
    if state.device.type != "cpu":
        return state.mean(1), (state @ vector).transpose(1, 2)
    return _Condensed.apply(state, vector)


class GatLn(nn.Module):
    r"""Graph attention with Lipschitz-normalised scores.

    Head $h$ projects features to $x'_i = W_h x_i$ and gives vertex $i$ the sum of $a_{ij} x'_j$ over its ring, itself
    included, where $a_{ij}$ is the softmax over $j$ of the leaky rectifier of

    $$\alpha\, e_{ij} / \max\big(\lVert e_{i\cdot} \rVert,\;
      \lVert a_h \rVert \sqrt{\max_k \lvert x'_k \rvert^2 + \lvert x'_i \rvert^2}\big),
      \qquad e_{ij} = a_h^{(1)} \cdot x'_i + a_h^{(2)} \cdot x'_j$$

    The outputs are $\tanh$ of the mean over the heads of a group of such sums. So $\lvert\text{score}\rvert \le \alpha$
    however large the features are, and `alpha=0` gives the mean of the ring. Weights are drawn, head by head, as in
    Glorot and Bengio 2010.

    Args:
        inputs: Width of the features.
        outputs: Width of the result, per head.
        heads: Number of heads; all of them together.
        groups: Number of results; the heads of one are averaged. As many as heads: the heads stay apart.
        alpha: Scale of the scores; None leaves them as they are (ordinary graph attention).
        extra: Width of further features of each vertex, which all heads are given beside their own.

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
        """Features of all vertices in some frames, one step of attention later.

        Args:
            graph: Who looks at whom.
            x: Features (frames, heads, verts, inputs); an axis of 1 holds for all frames, for all heads.
            scale: Factors of features (frames, inputs); None: 1.
            extra: Further features (frames, verts, extra), which are data: no gradient reaches them; None: none.

        Returns:
            Features (frames, groups, verts, outputs), each between -1 and 1.

        Raises:
            BadInput: Further features are not as many as the layer has weights for.
        """
        wanted = self.extra_weights.shape[1]
        if extra is not None and extra.shape[-1] != wanted:
            got = f"{extra.shape[-1]} of a vertex"
            raise BadInput(f"a layer made for {wanted} further features", got, "give as many, or none")
        if x.device.type != "cpu":
            return gathered_attention(self, graph, x, scale, extra)
        scale = x.new_zeros((0, 0)) if scale is None else scale
        extra = x.new_zeros((0, x.shape[2], 0)) if extra is None else extra
        return _Attention.apply(
            graph, x, scale, self.weights, extra, self.extra_weights, self.vectors, self.groups, self.alpha
        )


_sent: WeakKeyDictionary[Graph, dict[torch.device, tuple[Tensor, Tensor]]] = WeakKeyDictionary()


def _padded(graph: Graph, device: torch.device) -> tuple[Tensor, Tensor]:
    """`Graph.padded` on a device, sent there once."""
    there = _sent.setdefault(graph, {})
    if device not in there:
        ring, held = graph.padded
        there[device] = torch.from_numpy(ring).to(device), torch.from_numpy(held).to(device)
    return there[device]


def gathered_attention(
    layer: GatLn, graph: Graph, x: Tensor, scale: Tensor | None = None, extra: Tensor | None = None
) -> Tensor:
    """The same layer in plain torch, on rings of equal length: for devices that the kernels are not for.

    Args:
        layer: The layer.
        graph: Who looks at whom.
        x: Features (frames, heads, verts, inputs); an axis of 1 holds for all frames, for all heads.
        scale: Factors of features (frames, inputs); None: 1.
        extra: Further features (frames, verts, extra); None: none.

    Returns:
        Features (frames, groups, verts, outputs), each between -1 and 1.
    """
    ring, held = _padded(graph, x.device)
    x = x if scale is None else x * scale[:, None, None, :]
    projected = x @ layer.weights
    if extra is not None:
        projected = projected + extra[:, None] @ layer.extra_weights
    looks, looked_at = (projected @ layer.vectors.transpose(1, 2)).unbind(-1)
    scores = looks[..., None] + looked_at[..., ring]
    if layer.alpha is not None:
        squares = projected.square().sum(-1)
        bound = layer.vectors.square().sum((1, 2)).sqrt()[:, None] * (squares[..., ring].amax(-1) + squares).sqrt()
        norms = (scores * held).square().sum(-1).sqrt()
        scores = layer.alpha * scores / torch.maximum(norms, bound).clamp(min=float(TINY))[..., None]
    scores = torch.nn.functional.leaky_relu(scores, float(SLOPE)).masked_fill(held == 0, -torch.inf)
    gathered = (scores.softmax(-1)[..., None, :] @ projected[:, :, ring])[..., 0, :]
    return torch.tanh(gathered.unflatten(1, (layer.groups, -1)).mean(2))
