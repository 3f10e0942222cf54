"""The network at run time."""

import numpy as np
import pytest

from hemline.errors import BadModel
from hemline.learning.mlp import Mlp


def made(inputs=40, hidden=30, outputs=12) -> Mlp:
    random = np.random.default_rng(0)
    sizes = ((hidden, inputs), (hidden, hidden), (outputs, hidden))
    return Mlp.from_weights([random.normal(size=s) / 5 for s in sizes], [random.normal(size=s[0]) for s in sizes])


def test_kernel_equals_numpy_and_float64():
    net = made()
    inputs = np.random.default_rng(1).normal(size=(5, 40)).astype(np.float32)
    many = net.many(inputs)
    one = np.stack([net(row) for row in inputs])
    exact = inputs.astype(np.float64)
    for i, (weights, biases) in enumerate(zip(net.weights, net.biases, strict=True)):
        exact = exact @ weights.astype(np.float64).T + biases
        exact = np.maximum(exact, 0) if i < 2 else exact
    # sums of 40 float32 products of order one
    np.testing.assert_allclose(one, exact, atol=1e-5)
    np.testing.assert_allclose(many, exact, atol=1e-5)


def exactly(net, inputs):
    value = inputs.astype(np.float64)
    for i, (weights, biases) in enumerate(zip(net.weights, net.biases, strict=True)):
        value = weights.astype(np.float64) @ value + biases
        value = np.maximum(value, 0) if i < 2 else value
    return value


def test_weights_below_the_normal_numbers_of_float16_count_in_full():
    # all weights are of the order of 1e-6, where float16 has steps of 6e-8 and a flush to zero would leave nothing
    random = np.random.default_rng(2)
    net = Mlp.from_weights(
        [random.normal(size=(7, 7)) * 1e-6 for _ in range(3)], [random.normal(size=7) for _ in range(3)]
    )
    quiet = Mlp(net.weights, tuple(np.zeros_like(b) for b in net.biases[:2]) + (np.zeros(7, np.float32),))
    inputs = random.normal(size=7).astype(np.float32) * 1e6
    np.testing.assert_allclose(quiet(inputs), exactly(quiet, inputs), rtol=1e-5)
    assert np.abs(quiet(inputs)).max() > 0
    np.testing.assert_allclose(net(inputs), exactly(net, inputs), rtol=1e-5)


def test_weights_as_large_as_float16_has_them_count_in_full():
    random = np.random.default_rng(3)
    net = Mlp.from_weights(
        [random.normal(size=(9, 9)) * 1e4 for _ in range(3)], [random.normal(size=9) for _ in range(3)]
    )
    inputs = random.normal(size=9).astype(np.float32)
    found, exact = net(inputs), exactly(net, inputs)
    np.testing.assert_allclose(found, exact, atol=1e-5 * np.abs(exact).max())


def test_inputs_that_are_zero_change_nothing():
    net, inputs = made(), np.random.default_rng(1).normal(size=40).astype(np.float32)
    inputs[::3] = 0
    np.testing.assert_allclose(net(inputs), net.many(inputs[None])[0], atol=1e-5)
    np.testing.assert_allclose(net(np.zeros(40, np.float32)), net.many(np.zeros((1, 40)))[0], atol=1e-5)


def test_torch_agrees():
    torch = pytest.importorskip("torch", reason="torch is the second route")
    net, inputs = made(), np.random.default_rng(1).normal(size=40).astype(np.float32)
    value = torch.from_numpy(inputs)
    for i, (weights, biases) in enumerate(zip(net.weights, net.biases, strict=True)):
        value = torch.nn.functional.linear(value, torch.from_numpy(weights), torch.from_numpy(biases))
        value = torch.relu(value) if i < 2 else value
    np.testing.assert_allclose(net(inputs), value.numpy(), atol=1e-5)


def test_a_silent_network_says_nothing():
    net, inputs = made().with_zero_output(), np.random.default_rng(1).normal(size=40).astype(np.float32)
    assert not net(inputs).any() and not net.many(inputs[None]).any()
    assert [w.shape for w in net.weights] == [w.shape for w in made().weights]


def test_storing_changes_no_bit():
    net = made()
    back = Mlp.of(net.arrays(), inputs=40, outputs=12)
    for one, other in zip(net.weights + net.biases, back.weights + back.biases, strict=True):
        np.testing.assert_array_equal(one, other)
        assert other.dtype == np.float32


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"weight0": np.zeros((30, 41), np.float16)}, r"'weight0' of the model must be float16 \(any, 40\)"),
        ({"weight1": np.zeros((30, 30), np.float32)}, "'weight1' of the model must be float16"),
        ({"weight2": np.zeros((11, 30), np.float16)}, r"'weight2' of the model must be float16 \(12, 30\)"),
        ({"weight0": np.full((30, 40), np.inf, np.float16)}, "'weight0' of the model must be finite"),
        ({"bias1": np.zeros((30, 1), np.float32)}, "'bias1'"),
        ({"bias2": None}, "lacks array 'bias2'"),
    ],
)
def test_damaged_networks_are_refused(change, complaint):
    arrays = {name: array for name, array in (made().arrays() | change).items() if array is not None}
    with pytest.raises(BadModel, match=complaint):
        Mlp.of(arrays, inputs=40, outputs=12)


def test_a_network_without_outputs_is_refused():
    arrays = made().arrays() | {"weight2": np.zeros((0, 30), np.float16), "bias2": np.zeros(0, np.float32)}
    with pytest.raises(BadModel, match="no outputs"):
        Mlp.of(arrays, inputs=40, outputs=0)


@pytest.mark.parametrize("bad", [np.nan, 1e6])
def test_a_diverged_training_is_refused(bad):
    with pytest.raises(BadModel, match="training diverged"):
        Mlp.from_weights([np.full((2, 2), bad)] * 3, [np.zeros(2)] * 3)
