"""Graph attention with Lipschitz-normalised scores: equal to plain torch, and the laws that it must obey."""

import itertools
import os
import subprocess
import sys
from copy import deepcopy
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from hemline.animators.swingar.curve_kernels import fill_exponentials, tangent
from hemline.animators.swingar.graph import Graph
from hemline.compiled import kernel
from hemline.errors import BadInput, BadMesh
from hemline.learning.product_kernels import product
from tests.animators.swingar.swingar_samples import graph_of, sheet

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.animators.swingar.fit import layers  # noqa: E402  # after the skip
from hemline.animators.swingar.fit.layers import GatLn, condense_heads, gather_attention  # noqa: E402  # after the skip

GRAPH = graph_of()
VERTS = GRAPH.vertex_count


def dense_attention(layer, graph, x, scale=None, extra=None):
    """A layer in plain torch, on matrices of all pairs of vertices."""
    mask = torch.zeros((graph.vertex_count, graph.vertex_count), dtype=torch.bool)
    mask[torch.from_numpy(graph.ring_centers.astype(np.int64)), torch.from_numpy(graph.ring.astype(np.int64))] = True
    x = x if scale is None else x * scale[:, None, None, :]
    projected = torch.einsum("thvf,hfd->thvd", x.expand(-1, len(layer.weights), -1, -1), layer.weights)
    if extra is not None:
        projected = projected + torch.einsum("tvl,hld->thvd", extra, layer.extra_weights)
    looks, looked_at = torch.einsum("thvd,hkd->kthv", projected, layer.vectors)
    scores = looks[..., :, None] + looked_at[..., None, :]
    if layer.alpha is not None:
        squares = projected.square().sum(-1)
        most = squares[..., None, :].expand_as(scores).masked_fill(~mask, 0.0).amax(-1)
        length = layer.vectors.square().sum((1, 2)).sqrt()[None, :, None]
        norms = scores.masked_fill(~mask, 0.0).square().sum(-1).sqrt()
        scores = layer.alpha * scores / torch.maximum(norms, length * (most + squares).sqrt())[..., None]
    scores = torch.nn.functional.leaky_relu(scores, 0.2).masked_fill(~mask, -torch.inf)
    gathered = scores.softmax(-1) @ projected
    return torch.tanh(gathered.unflatten(1, (layer.groups, -1)).mean(2))


def test_a_ring_is_the_vertex_and_its_neighbours():
    graph = Graph.of(np.array([[0, 1, 2], [2, 1, 3]], np.int32), 5)
    rings = [graph.ring[a:b].tolist() for a, b in itertools.pairwise(graph.start)]
    assert rings == [[0, 1, 2], [0, 1, 2, 3], [0, 1, 2, 3], [1, 2, 3], [4]]
    assert graph.ring_centers.tolist() == [0] * 3 + [1] * 4 + [2] * 4 + [3] * 3 + [4]
    assert graph.start.dtype == graph.ring.dtype == np.int32
    ring, held = graph.equal_rings
    assert [row[there > 0].tolist() for row, there in zip(ring, held, strict=True)] == rings
    assert ring[4].tolist() == [4] * 4


def test_a_triangle_of_no_vertex_is_refused():
    with pytest.raises(BadMesh, match="must name some of 3 vertices; got 0 to 3; count from 0"):
        Graph.of(np.array([[0, 1, 3]], np.int32), 3)


@pytest.mark.parametrize("shape", [(1, 1, 1), (6, 3, 32), (7, 5, 33), (13, 300, 64), (40, 27, 45)])
def test_products_are_those_of_numpy(shape):
    n, k, m = shape
    random = np.random.default_rng(0)
    left, right = (random.normal(size=size).astype(np.float32) for size in ((n, k), (k, m)))
    out, turned = np.empty((n, m), np.float32), np.empty((n, m), np.float32)
    product(left, right, out)
    product(np.ascontiguousarray(left.T).T, right, turned)
    assert np.allclose(out, left @ right, atol=2e-4) and np.array_equal(out, turned)


@kernel
def fill_tangents(values, out):
    for i in range(len(values)):
        out[i] = tangent(values[i])


def test_curves_are_those_of_numpy():
    x = np.linspace(-30, 30, 100_001).astype(np.float32)
    out = np.empty_like(x)
    fill_tangents(x, out)
    assert np.abs(out - np.tanh(x.astype(np.float64))).max() < 4e-7
    fill_exponentials(x, out)
    assert np.abs(out / np.exp(x.astype(np.float64)) - 1).max() < 3e-7
    fill_exponentials(np.array([-200.0, -np.inf], np.float32), out[:2])
    assert np.all(out[:2] < 1e-37)


CASES = [
    # x for all frames, for all heads; heads, groups; scaled, extra, alpha
    (1, 1, 4, 4, False, 0, 2.0),
    (3, 1, 8, 2, False, 0, 2.0),
    (1, 4, 4, 4, True, 5, 3.0),
    (3, 1, 3, 3, False, 5, 1.0),
    (3, 3, 3, 3, False, 0, None),
    (3, 1, 1, 1, True, 0, 0.0),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_values_and_gradients_are_those_of_dense_matrices(case):
    frames, of_heads, heads, groups, scaled, more, alpha = case
    torch.manual_seed(1)
    layer = GatLn(7, 40, heads, groups=groups, alpha=alpha, extra=more)
    x = torch.randn(frames, of_heads, VERTS, 7, requires_grad=True)
    scale = torch.randn(3, 7, requires_grad=True) if scaled else None
    extra = torch.randn(3, VERTS, more) if more else None
    found, plain = layer(GRAPH, x, scale=scale, extra=extra), dense_attention(layer, GRAPH, x, scale, extra)
    assert (found - plain).abs().max() < 1e-5
    gathered = gather_attention(layer, GRAPH, x, scale, extra)
    assert (gathered - plain).abs().max() < 1e-5
    back = torch.randn_like(plain)
    given = [each for each in (x, scale, *layer.parameters()) if each is not None and each.numel()]
    ours, slots, theirs = (torch.autograd.grad((out * back).sum(), given) for out in (found, gathered, plain))
    for one, two, other in zip(ours, slots, theirs, strict=True):
        assert (one - other).abs().max() <= 1e-5 * max(1.0, float(other.abs().max()))
        assert (two - other).abs().max() <= 1e-5 * max(1.0, float(other.abs().max()))


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA device")
@pytest.mark.parametrize("compiled", [True, False])
def test_on_cuda_a_layer_and_its_gradients_are_the_same(compiled, monkeypatch):
    monkeypatch.setattr(layers, "has_triton", lambda: compiled and find_spec("triton") is not None)
    torch.manual_seed(3)
    layer, x, scale = GatLn(5, 7, 4, alpha=2.0, extra=3), torch.randn(1, 4, VERTS, 5), torch.randn(3, 5)
    extra, back = torch.randn(3, VERTS, 3), torch.randn(3, 4, VERTS, 7)

    def run(device):
        own = GatLn(5, 7, 4, alpha=2.0, extra=3).to(device)
        own.load_state_dict(layer.state_dict())
        given = [each.to(device).requires_grad_() for each in (x, scale)]
        out = own(GRAPH, given[0], scale=given[1], extra=extra.to(device))
        return [out, *torch.autograd.grad((out * back.to(device)).sum(), [*given, *own.parameters()])]

    for one, other in zip(run("cpu"), run("cuda"), strict=True):
        assert (one - other.cpu()).abs().max() <= 1e-5 * max(1.0, float(one.abs().max()))


TRITON_CASES = [
    # x for all frames, for all heads; width, heads, groups; scaled, extra, alpha
    (1, 4, 3, 4, 4, True, 5, 2.0),
    (2, 1, 3, 4, 2, False, 0, 3.0),
    (2, 1, 5, 6, 2, True, 5, None),
    (2, 3, 40, 3, 3, False, 5, 2.0),
    (1, 3, 8, 3, 3, True, 0, None),
    (2, 1, 1, 1, 1, False, 0, 0.0),
]


def irregular() -> Graph:
    """A graph with a hub, a vertex in no triangle, and rings of many sizes."""
    random = np.random.default_rng(5)
    fan = np.stack([np.zeros(11, np.int64), np.arange(1, 12), np.arange(2, 13)], 1)
    there = random.choice(np.arange(1, 35), (30, 3))
    three = (there[:, 0] != there[:, 1]) & (there[:, 1] != there[:, 2]) & (there[:, 0] != there[:, 2])
    return Graph.of(np.concatenate([fan, there[three]]).astype(np.int32), 37)


def run_in_interpreter() -> None:
    """Compares layers by Triton with plain torch in float64, and prints the largest relative errors of each case.

    The environment must hold TRITON_INTERPRET=1.
    """
    graph, met = irregular(), np.zeros(3, bool)
    for frames, of_heads, width, heads, groups, scaled, more, alpha in TRITON_CASES:
        torch.manual_seed(6)
        layer = GatLn(7, width, heads, groups=groups, alpha=alpha, extra=more)
        tiny = torch.ones(graph.vertex_count, 1)
        tiny[torch.from_numpy(graph.ring[graph.start[20] : graph.start[21]].astype(np.int64))] = 1e-14
        x, scale = torch.randn(frames, of_heads, graph.vertex_count, 7) * tiny, torch.randn(2, 7) if scaled else None
        extra = torch.randn(2, graph.vertex_count, more) * tiny if more else None
        back = torch.randn(2, groups, graph.vertex_count, width)

        def run(kind, compiled, layer=layer, parts=(x, scale, extra), back=back):
            layers.is_compiled_on = lambda device: compiled
            own = deepcopy(layer).to(kind)
            x, scale, extra = (None if part is None else part.to(kind) for part in parts)
            given = [each.requires_grad_() for each in (x, scale) if each is not None]
            given += [each for each in own.parameters() if each.numel()]
            out = gather_attention(own, graph, x, scale, extra)
            return [out, *torch.autograd.grad((out * back.to(kind)).sum(), given, allow_unused=True)]

        errors = []
        for one, other in zip(run(torch.float32, True), run(torch.float64, False), strict=True):
            errors.append(float((one - other).detach().abs().max() / other.detach().abs().max().clamp(min=1e-30)))
        print((width, heads, groups, alpha), *(f"{error:.1e}" for error in errors))
        assert max(errors) < 1e-4
        if alpha:
            met |= branches(layer, graph, x, scale, extra)
    assert met.all(), met


def branches(layer, graph, x, scale, extra) -> np.ndarray:
    """Tells whether some divisors of scores are the norm of the scores, its bound, and the least divisor."""
    table, rings = layers._project(layer, x, scale, extra).detach().numpy(), graph.equal_rings
    width, length = layer.weights.shape[2], layer.vectors.detach().square().sum((1, 2)).sqrt().numpy()[:, None]
    features, center, neighbour = table[..., :width], table[..., width], table[..., width + 1]
    norms = np.sqrt((((center[..., None] + neighbour[..., rings[0]]) * rings[1]) ** 2).sum(-1))
    squares = (features**2).sum(-1)
    bound = length * np.sqrt(squares[..., rings[0]].max(-1) + squares)
    large = np.maximum(norms, bound) > 1e-12
    return np.array([np.any(large & (norms > bound)), np.any(large & (norms <= bound)), not large.all()])


@pytest.mark.skipif(find_spec("triton") is None, reason="Triton is not installed")
def test_in_the_interpreter_of_triton_a_layer_and_its_gradients_are_the_same():
    code = "from tests.animators.swingar.test_swingar_layers import run_in_interpreter; run_in_interpreter()"
    environment = os.environ | {"TRITON_INTERPRET": "1"}
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", code], cwd=root, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_further_features_that_a_layer_has_no_weights_for_are_refused():
    layer = GatLn(5, 4, 2, alpha=2.0)
    with pytest.raises(BadInput, match="a layer made for 0 further features; got 3 of a vertex; give as many, or none"):
        layer(GRAPH, torch.randn(1, 1, VERTS, 5), extra=torch.randn(1, VERTS, 3))


def test_gradients_are_those_of_small_differences():
    torch.manual_seed(2)
    layer, x = GatLn(5, 4, 2, alpha=2.0), torch.randn(1, 1, VERTS, 5)
    back = torch.randn(1, 2, VERTS, 4)
    loss = (layer(GRAPH, x) * back).sum()
    (gradient,) = torch.autograd.grad(loss, [layer.weights])
    for index in ((0, 0, 0), (1, 4, 3), (0, 2, 1)):
        ends = []
        for step in (-1e-2, 1e-2):
            with torch.no_grad():
                layer.weights[index] += step
                ends.append(float((layer(GRAPH, x).double() * back).sum()))
                layer.weights[index] -= step
        assert (ends[1] - ends[0]) / 2e-2 == pytest.approx(float(gradient[index]), rel=2e-2, abs=2e-3)


def test_what_all_heads_give_together():
    state, vector = torch.randn(2, 5, VERTS, 9, requires_grad=True), torch.randn(9, requires_grad=True)
    mean, scores = condense_heads(state, vector)
    plain = state.mean(1), (state @ vector).transpose(1, 2)
    assert torch.allclose(mean, plain[0], atol=1e-6) and torch.allclose(scores, plain[1], atol=1e-5)
    back = torch.randn_like(mean), torch.randn_like(scores)
    ours = torch.autograd.grad((mean, scores), (state, vector), back)
    theirs = torch.autograd.grad(plain, (state, vector), back)
    assert all(torch.allclose(a, b, atol=1e-4) for a, b in zip(ours, theirs, strict=True))


def scores_of(layer: GatLn, x: np.ndarray, i: int, j: int) -> float:
    """The normalised score of an edge by the formula of the published code, one head, in float64."""
    weights, vectors = (each[0].detach().numpy().astype(np.float64) for each in (layer.weights, layer.vectors))
    projected = x @ weights
    ring = GRAPH.ring[GRAPH.start[i] : GRAPH.start[i + 1]]
    raw = projected[i] @ vectors[0] + projected[ring] @ vectors[1]
    most = max(np.sum(projected[k] ** 2) for k in ring)
    bound = np.linalg.norm(vectors) * np.sqrt(most + np.sum(projected[i] ** 2))
    return layer.alpha * raw[ring.tolist().index(j)] / max(np.linalg.norm(raw), bound)


@pytest.mark.parametrize("factor", [1.0, 1000.0])
def test_with_one_head_it_is_the_published_formula_and_scores_stay_within_alpha(factor):
    torch.manual_seed(3)
    layer = GatLn(5, 32, 1, alpha=2.0)
    x = factor * np.random.default_rng(3).normal(size=(VERTS, 5)).astype(np.float32)
    found = layer(GRAPH, torch.from_numpy(x)[None, None])[0, 0].detach().numpy()
    projected = x.astype(np.float64) @ layer.weights[0].detach().numpy()
    for i in range(VERTS):
        ring = GRAPH.ring[GRAPH.start[i] : GRAPH.start[i + 1]]
        scores = np.array([scores_of(layer, x.astype(np.float64), i, j) for j in ring])
        assert np.abs(scores).max() <= 2.0
        shares = np.exp(np.where(scores > 0, scores, 0.2 * scores))
        assert np.allclose(found[i], np.tanh(shares @ projected[ring] / shares.sum()), atol=1e-4)


def test_several_heads_are_the_heads_done_one_by_one():
    layer, x = GatLn(5, 32, 3, alpha=2.0), torch.randn(2, 3, VERTS, 5)
    together = layer(GRAPH, x)
    for head in range(3):
        single = GatLn(5, 32, 1, alpha=2.0)
        for name in ("weights", "extra_weights", "vectors"):
            setattr(single, name, torch.nn.Parameter(getattr(layer, name)[head : head + 1]))
        assert torch.equal(single(GRAPH, x[:, head : head + 1])[:, 0], together[:, head])


def test_a_scale_of_zero_gives_the_mean_of_the_ring():
    layer, x = GatLn(5, 8, 2, alpha=0.0), torch.randn(1, 1, VERTS, 5)
    found, projected = layer(GRAPH, x)[0], (x[0] @ layer.weights).detach()
    for i in range(VERTS):
        ring = GRAPH.ring[GRAPH.start[i] : GRAPH.start[i + 1]].astype(np.int64)
        assert torch.allclose(found[:, i], torch.tanh(projected[:, ring].mean(1)), atol=1e-6)


def test_permuting_vertices_permutes_the_output():
    order = np.random.default_rng(4).permutation(VERTS)
    renamed = Graph.of(np.argsort(order)[sheet()[1]].astype(np.int32), VERTS)
    layer, x = GatLn(5, 32, 4, alpha=2.0), torch.randn(2, 1, VERTS, 5)
    ids = torch.from_numpy(order)
    assert torch.allclose(layer(renamed, x[:, :, ids]), layer(GRAPH, x)[:, :, ids], atol=1e-6)


def test_features_of_zero_give_zero():
    assert not GatLn(5, 8, 2, alpha=2.0)(GRAPH, torch.zeros(1, 1, VERTS, 5)).any()
