"""A neural distance while it is trained: its losses, and what diverged."""

import pytest

from hemline.errors import BadModel

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.learning.fit.distance_network import DistanceNetwork, distance_loss  # noqa: E402  # after the skip


def directions(count: int) -> torch.Tensor:
    given = torch.randn((count, 3), generator=torch.Generator().manual_seed(0))
    return given / given.norm(dim=1, keepdim=True)


def test_the_loss_is_that_of_equations_8_and_9():
    normals = directions(50)
    truth = torch.linspace(-0.1, 0.1, 50)
    weights = {"value_weight": 1.0, "eikonal_weight": 0.15}
    assert distance_loss(truth, normals, truth, normals, **weights).item() == pytest.approx(0, abs=2e-4)
    off = distance_loss(truth + 0.02, normals, truth, normals, value_weight=1.0, eikonal_weight=0.0)
    assert off.item() == pytest.approx(0.02, abs=2e-4)
    longer = distance_loss(truth, 1.5 * normals, truth, normals, **weights)
    assert longer.item() == pytest.approx(0.5 + 0.15 * 0.25, abs=1e-3)


def test_the_gradient_by_the_weights_is_that_of_differences():
    drawn = DistanceNetwork.initialize("point", width=16, condition=5, seed=0)
    points, normals = 0.3 * directions(40), directions(40).flip(0)
    turns = torch.eye(3).expand(40, 3, 3)
    conditions = torch.randn((1, 5), generator=torch.Generator().manual_seed(1))

    def loss() -> torch.Tensor:
        codes = drawn.code(conditions).expand(40, -1)
        found = drawn.with_gradients(points.to(codes.dtype), turns.to(codes.dtype), codes)
        return distance_loss(*found, points.norm(dim=1), normals, value_weight=2.0, eikonal_weight=0.15)

    drawn.layers = {n: tuple(t.detach().double().requires_grad_() for t in layer) for n, layer in drawn.layers.items()}
    points, normals, turns, conditions = (each.double() for each in (points, normals, turns, conditions))
    loss().backward()
    for name in ("point0", "point1", "body1", "fusion0", "fusion1"):
        weight = drawn.layers[name][0]
        with torch.no_grad():
            weight[0, 1] += 1e-6
            above = loss()
            weight[0, 1] -= 2e-6
            below = loss()
            weight[0, 1] += 1e-6
        assert (above - below).item() / 2e-6 == pytest.approx(weight.grad[0, 1].item(), rel=1e-3, abs=1e-6)


def test_a_training_that_diverged_is_refused():
    drawn = DistanceNetwork.initialize("point", width=8, condition=5, seed=0)
    with torch.no_grad():
        drawn.layers["point1"][0][0, 0] = 1e6
    with pytest.raises(BadModel, match="the training diverged"):
        drawn.to_neural_sdf(("anny24", "hash"), (-2, 2), {})
