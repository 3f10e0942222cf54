"""The estimator: what it is made of, its laws, its twin that plays."""

from dataclasses import replace

import numpy as np
import pytest

from hemline.animators.swingar.estimator_config import EstimatorConfig, weight_shapes
from hemline.animators.swingar.graph import Graph
from hemline.animators.swingar.graph_inputs import skin_logits
from hemline.animators.swingar.runtime import RuntimeEstimator
from hemline.errors import BadInput, BadModel
from tests.animators.swingar.swingar_samples import SMALL, graph_of, inputs, sheet

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.animators.swingar.fit.estimator import Estimator, cost  # noqa: E402  # after the skip

FRAMES = 3
CONFIGS = {
    "small": EstimatorConfig(**SMALL, told=9, state_told=4, displacement=5, body=76, corrective_heads=2),
    "context": EstimatorConfig(**SMALL, told=9, state_told=4, displacement=5, context=True, body=76),
    "pooled": EstimatorConfig(**SMALL | {"blend_last": 12}, body=76, corrective_heads=2, global_shape="pooled"),
    "plain": EstimatorConfig(**SMALL, body=76, corrective_heads=1, global_shape="none", lipschitz=False),
}


def made(config: EstimatorConfig, seed: int = 0) -> Estimator:
    """An estimator whose outputs are not small at the start."""
    torch.manual_seed(seed)
    estimator = Estimator(config)
    with torch.no_grad():
        for parameter in (estimator.corrective_scale, estimator.blend_scale):
            parameter.fill_(0.3)
        estimator.peepholes.normal_()
        estimator.weight.weight.normal_()
        if estimator.config.displacement:
            estimator.displace.weight.normal_()
            estimator.told_mean.normal_()
            estimator.told_spread.uniform_(0.5, 2)
    return estimator


def run(estimator: Estimator, graph: Graph, given: dict[str, np.ndarray]) -> list[np.ndarray]:
    """Coarse mesh, weights, blend shape and displacement of all frames."""
    t = {name: torch.from_numpy(each) for name, each in given.items()}
    with torch.no_grad():
        garment = estimator.garment(graph, t["features"], t["descriptor"], t["skin_logits"])
        told = (t["told"], t["turns"]) if estimator.config.told else ()
        coarse = estimator.coarse(garment, t["motion"], t["transforms"], *told)
        found = [*coarse, estimator.corrective(garment, t["meshes"], t["joints"], t["body"])]
    return [each.numpy() for each in found]


def arrays_of(estimator: Estimator) -> dict[str, np.ndarray]:
    return {name: each.numpy() for name, each in estimator.state_dict().items()}


@pytest.mark.parametrize("name", CONFIGS)
def test_the_twin_that_plays_is_equal(name):
    config, graph = CONFIGS[name], graph_of()
    estimator, given = made(config), inputs(CONFIGS[name], graph.vertex_count, FRAMES)
    played = RuntimeEstimator.of(config, arrays_of(estimator), "float32")
    garment = played.garment(graph, given["features"], given["descriptor"], given["skin_logits"])
    batch = run(estimator, graph, given)
    for frame in range(FRAMES):
        told = [given[each][frame] for each in ("told", "turns")] if config.told else []
        coarse = played.coarse(garment, given["motion"][frame], given["transforms"][frame], *told)
        corrective = played.corrective(garment, *(given[each][frame] for each in ("meshes", "joints", "body")))
        for one, other in zip([*coarse, corrective], batch, strict=True):
            assert np.abs(one - other[frame]).max() < 1e-5  # and so one frame at a time is a batch of frames


@pytest.mark.parametrize(
    "config", [*CONFIGS.values(), EstimatorConfig(), EstimatorConfig.lean(told=12, displacement=8)]
)
def test_no_array_of_the_weights_knows_a_vertex_count(config):
    found = {name: tuple(each.shape) for name, each in Estimator(config).state_dict().items()}
    assert found == weight_shapes(config)


def test_sizes_are_those_of_the_trial():
    full, lean = (sum(n for n, _ in cost(each, 2500).values()) for each in (EstimatorConfig(), EstimatorConfig.lean()))
    assert 1.25e6 < full < 1.35e6 and 0.8e6 < lean < 0.9e6
    parts, once = cost(EstimatorConfig(), 2500), ("graph_first", "graph_second", "shape")
    work = sum(flops for name, (_, flops) in parts.items() if name not in once)
    assert 2e6 < work / 2500 < 3e6  # operations a vertex and frame; the trial's page says 2.3 million


def test_at_the_start_it_is_skinning_and_adds_no_correction():
    config, graph = CONFIGS["small"], graph_of()
    torch.manual_seed(5)
    estimator, given = Estimator(config), inputs(config, graph.vertex_count, 1)
    weights = np.random.default_rng(5).dirichlet(np.full(24, 0.1), graph.vertex_count).astype(np.float32)
    given["skin_logits"] = skin_logits(weights)
    _, dynamic, blend, corrective = run(estimator, graph, given)
    assert not corrective.any()
    assert np.abs(blend).max() < 0.1
    assert np.abs(dynamic[0] - weights).max() < 0.1
    assert np.allclose(dynamic.sum(-1), 1, atol=1e-5)


def test_permuting_vertices_permutes_the_output():
    config, graph = CONFIGS["small"], graph_of()
    estimator, given = made(config), inputs(config, graph.vertex_count, FRAMES)
    order = np.random.default_rng(6).permutation(graph.vertex_count)
    renamed = Graph.of(np.argsort(order)[sheet()[1]].astype(np.int32), graph.vertex_count)
    turned = given | {name: given[name][order] for name in ("features", "skin_logits")}
    turned |= {name: given[name][:, order] for name in ("told", "turns")}
    turned |= {"meshes": given["meshes"][:, :, order]}
    for one, other in zip(run(estimator, renamed, turned), run(estimator, graph, given), strict=True):
        assert np.abs(one - other[:, order]).max() < 1e-5


def test_the_same_pose_after_another_history_gives_another_mesh():
    config, graph = CONFIGS["small"], graph_of()
    estimator, given = made(config), inputs(config, graph.vertex_count, 1)
    before = run(estimator, graph, given)[0]
    given["motion"][:, :-1] *= -1
    assert np.abs(run(estimator, graph, given)[0] - before).max() > 1e-3


def test_gradients_reach_all_weights_each_by_its_stage():
    config, graph = CONFIGS["small"], graph_of()
    estimator = made(config)
    t = {name: torch.from_numpy(each) for name, each in inputs(config, graph.vertex_count, FRAMES).items()}
    garment = estimator.garment(graph, t["features"], t["descriptor"], t["skin_logits"])
    coarse, corrective = estimator.coarse_parameters(), estimator.corrective_parameters()
    assert {id(each) for each in (*coarse, *corrective)} == {id(each) for each in estimator.parameters()}
    given = (t[name] for name in ("motion", "transforms", "told", "turns"))
    found = torch.autograd.grad(estimator.coarse(garment, *given)[0].sum(), coarse)
    assert all(each.abs().max() > 0 for each in found if each.numel())
    found = torch.autograd.grad(estimator.corrective(garment, t["meshes"], t["joints"], t["body"]).sum(), corrective)
    assert all(each.abs().max() > 0 for each in found if each.numel())


def test_damaged_weights_are_refused():
    config = CONFIGS["small"]
    arrays = {name: each.astype(np.float16) for name, each in arrays_of(made(config)).items()}
    RuntimeEstimator.of(config, arrays)
    with pytest.raises(BadModel, match="lacks array 'state.weights'"):
        RuntimeEstimator.of(config, {name: each for name, each in arrays.items() if name != "state.weights"})
    with pytest.raises(BadModel, match="'weight.weight' of the model must be float16"):
        RuntimeEstimator.of(replace(config, state=11), arrays)
    with pytest.raises(BadModel, match="must be finite"):
        RuntimeEstimator.of(config, arrays | {"peepholes": arrays["peepholes"] * np.float16(np.nan)})


def test_a_body_without_betas_is_refused():
    with pytest.raises(BadInput, match="'body' must count betas beside 72 numbers of the pose; got 72"):
        EstimatorConfig(body=72)


def test_more_features_for_the_state_than_there_are_is_refused():
    with pytest.raises(BadInput, match="'state_told' must be at most 'told'; got 5 of 4"):
        EstimatorConfig(told=4, state_told=5)


def test_what_displaces_moves_each_vertex_as_skinning_turns_it():
    config, graph = CONFIGS["small"], graph_of()
    estimator, given = made(config), inputs(CONFIGS["small"], graph.vertex_count, 1)
    still = run(estimator, graph, given)[0]
    back = given["turns"] * np.float32([-1, -1, -1, -1])  # the same turn by the other quaternion
    assert np.abs(run(estimator, graph, given | {"turns": back})[0] - still).max() < 1e-5
    with torch.no_grad():
        estimator.displace.weight.zero_()
        estimator.displace.bias.copy_(torch.tensor([0.1, 0.0, 0.0]))
    moved = run(estimator, graph, given)[0]
    with torch.no_grad():
        estimator.displace.bias.zero_()
    w, x, y, z = given["turns"][0].T
    along = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
    assert np.abs(moved[0] - run(estimator, graph, given)[0][0] - 0.1 * along).max() < 1e-5
