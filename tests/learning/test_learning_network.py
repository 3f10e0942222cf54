"""A network in training, and the one that plays."""

import numpy as np
import pytest

from hemline.learning.ridge import ridge

torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
from hemline.learning.fit.network import (  # noqa: E402
    SMALLEST_DEVIATION,
    ScaledNetwork,
    deviations_of,
    random_layers,
    through,
)


def made(seed=0, outs=5):
    random = np.random.default_rng(seed)
    inputs = (random.normal(size=(60, 8)) * np.linspace(0.1, 2, 8) + 3).astype(np.float32)
    return ScaledNetwork(inputs, np.linspace(0.01, 1, outs).astype(np.float32), hidden=20, seed=seed), inputs


def test_what_plays_is_what_was_trained_but_for_16_bits():
    network, inputs = made()
    with torch.no_grad():
        trained = network(torch.from_numpy(inputs)).numpy()
    # weights of 11 bits: 20 products of order one, each off by up to 2^-11
    np.testing.assert_allclose(network.to_mlp().many(inputs), trained, atol=20 * 2**-11)


def test_scales_are_mean_and_deviation_of_the_inputs():
    network, inputs = made()
    inputs[:, 3] = 7.0
    again = ScaledNetwork(inputs, network.scale, hidden=20, seed=0)
    np.testing.assert_array_equal(again.mean, inputs.mean(axis=0))
    np.testing.assert_allclose(again.spread[:3], inputs.std(axis=0)[:3])
    assert again.spread[3] == np.float32(SMALLEST_DEVIATION) == deviations_of(inputs)[3]


def test_begun_as_a_line_it_is_the_ridge_regression():
    network, inputs = made()
    random = np.random.default_rng(1)
    outputs, noise = random.normal(size=(60, 5)).astype(np.float32), np.full(8, 0.3)
    network.start_linear(inputs, outputs, noise)
    matrix, offset = ridge(inputs, outputs, noise)
    with torch.no_grad():
        found = network(torch.from_numpy(inputs)).numpy()
    np.testing.assert_allclose(found, inputs @ matrix.T + offset, atol=1e-4)


def test_begun_at_zero_it_gives_zero():
    network, inputs = made()
    network.start_at_zero()
    assert not network(torch.from_numpy(inputs)).detach().numpy().any()


def test_an_output_of_scale_zero_stays_zero_whatever_is_trained():
    random = np.random.default_rng(0)
    inputs = random.normal(size=(30, 4)).astype(np.float32)
    network = ScaledNetwork(inputs, np.array([1, 0, 2], np.float32), hidden=10, seed=0)
    network(torch.from_numpy(inputs)).square().sum().backward()
    assert not network.layers[-1][0].grad[1].any() and network.layers[-1][0].grad[0].any()
    assert not network.to_mlp().many(inputs)[:, 1].any()


def test_weights_are_drawn_within_their_bound_by_the_seed():
    sizes = (50, 40, 3)
    one, same, other = (random_layers(sizes, torch.Generator().manual_seed(seed)) for seed in (1, 1, 2))
    for (weight, bias), ins in zip(one, sizes, strict=False):
        bound = np.sqrt(6 / ins)
        assert weight.abs().max() <= bound and not bias.any()
        # evenly drawn: the variance is bound^2 / 3 = 2 / ins
        if weight.numel() > 1000:
            assert float(weight.detach().var()) == pytest.approx(2 / ins, rel=0.1)
    assert torch.equal(one[0][0], same[0][0]) and not torch.equal(one[0][0], other[0][0])


def test_layers_of_what_plays_compute_what_it_plays():
    network, inputs = made()
    plays = network.to_mlp()
    layers = [tuple(map(torch.from_numpy, each)) for each in zip(plays.weights, plays.biases, strict=True)]
    found = through(layers, torch.from_numpy(inputs)).numpy()
    np.testing.assert_allclose(found, plays.many(inputs), atol=1e-5)
