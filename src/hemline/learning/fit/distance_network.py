"""A neural signed distance during training, with torch; at run time it is `collide.neural_sdf`."""

import math
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
import torch

from hemline.collide.neural_sdf.inputs import WIDTHS, Inputs, start
from hemline.collide.neural_sdf.neural_sdf import LAYERS, NeuralSdf
from hemline.errors import BadModel

SOFTPLUS_SHARPNESS = 100
"""Sharpness of the softplus."""
START_RADIUS = 0.5
"""Radius of the sphere as which the network of the paper starts [m]."""


class DistanceNetwork:
    r"""The layers of `NeuralSdf` in torch, on any device: distance and gradient, both differentiable by the weights.

    The gradient by the point is written out layer by layer, so that one backward pass of torch serves all losses.

    Source: Li et al., "SwinGar", 2023, Section IV; the start as a sphere: Atzmon, Lipman, "SAL", 2020, Theorem 1.
        Differs: with inputs `bones` the start is the distance to capsules around them.
    """

    def __init__(self, inputs: Inputs, layers: Mapping[str, tuple[torch.Tensor, torch.Tensor]]):
        self.inputs: Inputs = inputs
        self.layers = dict(layers)

    @classmethod
    def initialize(cls, inputs: Inputs, *, width: int, condition: int, seed: int) -> Self:
        """Makes a network that starts as a sphere, or as the capsules.

        Args:
            inputs: Features of a point that it reads.
            width: Neurons in each hidden layer; 512 in the paper.
            condition: Number of features of shape and pose.
            seed: Seed of the weights.
        """
        generator = torch.Generator().manual_seed(seed)
        ins = (WIDTHS[inputs], width, width, condition, width, width, 2 * width, width)
        layers = {}
        for name, size in zip(LAYERS, ins, strict=True):
            outs = 1 if name == "fusion1" else width
            weight = torch.randn((outs, size), generator=generator) * math.sqrt(2 / size)
            layers[name] = weight, torch.zeros(outs)
        layers["body0"][0].mul_(0.5)
        layers["fusion0"][0].mul_(0.5)
        last = layers["fusion1"]
        if inputs == "bones":
            last[0].mul_(0.02)
        else:
            layers["point0"][0].mul_(math.sqrt(3 / width))  # normal with variance 2 / width: lengths are kept
            layers["fusion0"][0][:, width:].mul_(0.1)
            last[0].mul_(1e-5).add_(math.sqrt(math.pi / width))
            _make_sphere(cls(inputs, layers), generator, condition)
        return cls(inputs, {name: (w.requires_grad_(), b.requires_grad_()) for name, (w, b) in layers.items()})

    @classmethod
    def of(cls, model: NeuralSdf) -> Self:
        """Makes a copy of a run-time network in torch, whose weights are not trained."""
        return cls(
            model.inputs, {name: (torch.from_numpy(w), torch.from_numpy(b)) for name, (w, b) in model.layers.items()}
        )

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Weights and biases, layer by layer."""
        return [parameter for name in LAYERS for parameter in self.layers[name]]

    def code(self, conditions: torch.Tensor) -> torch.Tensor:
        """Returns the part of shape and pose (bodies, condition) in the first fusion layer (bodies, width)."""
        first = self._apply_layer("body0", conditions)[0]
        third = first + self._apply_layer("body2", self._apply_layer("body1", first)[0])[0]
        weight, bias = self.layers["fusion0"]
        return torch.nn.functional.linear(third, weight[:, len(weight) :], bias)

    def distances(self, features: torch.Tensor, codes: torch.Tensor) -> torch.Tensor:
        """Returns signed distances [m] for features (points, inputs) and the code at each point (points, width)."""
        joined = self._backwards(features, codes)[0]
        return torch.nn.functional.linear(joined, *self.layers["fusion1"])[:, 0] + start(self.inputs, features)

    def with_gradients(
        self, features: torch.Tensor, jacobians: torch.Tensor, codes: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Returns signed distances [m] and gradients (points, 3), given the jacobians of the features."""
        joined, slope, slopes = self._backwards(features, codes)
        weight, bias = self.layers["fusion1"]
        distances = torch.nn.functional.linear(joined, weight, bias)[:, 0] + start(self.inputs, features)
        to_p3 = (slope * weight[0]) @ self.layers["fusion0"][0][:, : len(slope[0])]
        to_p2 = (to_p3 * slopes[2]) @ self.layers["point2"][0]
        to_p1 = (to_p2 * slopes[1]) @ self.layers["point1"][0] + to_p3
        to_features = (to_p1 * slopes[0]) @ self.layers["point0"][0]
        gradients = (to_features[:, None] @ jacobians)[:, 0]
        return distances, gradients + start(self.inputs, jacobians.swapaxes(1, 2))

    def _backwards(self, features: torch.Tensor, codes: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, list]:
        """Returns the joined layer, its slopes, and the slopes of the three layers of the point."""
        p1, slope1 = self._apply_layer("point0", features)
        p2, slope2 = self._apply_layer("point1", p1)
        p3, slope3 = self._apply_layer("point2", p2)
        weight = self.layers["fusion0"][0]
        joined, slope = _softplus(torch.nn.functional.linear(p1 + p3, weight[:, : len(weight)]) + codes)
        return joined, slope, [slope1, slope2, slope3]

    def _apply_layer(self, name: str, values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        return _softplus(torch.nn.functional.linear(values, *self.layers[name]))

    def to_neural_sdf(
        self, body: tuple[str, str], beta_range: tuple[float, float], figures: Mapping[str, Any]
    ) -> NeuralSdf:
        """Returns the run-time network, with weights rounded to 16 bits.

        Args:
            body: Name and hash of the body.
            beta_range: Lowest and highest coefficient of the training.
            figures: Results of the training.

        Raises:
            BadModel: A weight is too large for float16, or not finite: the training diverged.
        """
        layers = {name: tuple(each.detach().numpy() for each in layer) for name, layer in self.layers.items()}
        if not all(np.isfinite(w).all() and np.abs(w).max() < 6.5e4 for w, _ in layers.values()):
            raise BadModel("the training diverged", "weights beyond float16", "lower the learning rate")
        halves = {name: (w.astype(np.float16).astype(np.float32), np.array(b)) for name, (w, b) in layers.items()}
        return NeuralSdf(*body, self.inputs, beta_range, halves, dict(figures))


def _make_sphere(network: DistanceNetwork, generator: torch.Generator, condition: int) -> None:
    """Scales and shifts the last layer so that, on average, distances grow by 1 m a metre and are 0 at `START_RADIUS`.

    The theorem assumes rectified layers without residuals; softplus and residuals change the lengths it relies on.
    """
    directions = torch.randn((500, 3), generator=generator)
    directions /= directions.norm(dim=1, keepdim=True)
    codes = network.code(torch.zeros(1, condition)).expand(500, -1)
    inner, outer = (float(network.distances(r * START_RADIUS * directions, codes).mean()) for r in (0.5, 1.5))
    weight, bias = network.layers["fusion1"]
    scale = START_RADIUS / (outer - inner)
    weight.mul_(scale)
    bias.sub_(scale * (inner + outer) / 2)


class _Softplus(torch.autograd.Function):
    """Softplus and its slope; the derivatives of both follow from the slope."""

    @staticmethod
    def forward(ctx, values):  # pyright: ignore[reportIncompatibleMethodOverride]
        slopes = torch.sigmoid(SOFTPLUS_SHARPNESS * values)
        ctx.save_for_backward(slopes)
        return torch.nn.functional.softplus(values, beta=SOFTPLUS_SHARPNESS), slopes

    @staticmethod
    def backward(ctx, by_value, by_slope):  # pyright: ignore[reportIncompatibleMethodOverride]
        (slopes,) = ctx.saved_tensors
        return by_value * slopes + by_slope * (SOFTPLUS_SHARPNESS * slopes * (1 - slopes))


def _softplus(values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    return _Softplus.apply(values)  # pyright: ignore[reportReturnType]


def distance_loss(
    distances: torch.Tensor,
    gradients: torch.Tensor,
    truth: torch.Tensor,
    normals: torch.Tensor,
    *,
    value_weight: float,
    eikonal_weight: float,
) -> torch.Tensor:
    r"""Returns the mean of $\lambda |\mathcal S - s| + |\nabla\mathcal S - n| + \mu_e (|\nabla\mathcal S| - 1)^2$.

    Args:
        distances: $\mathcal S$ [m].
        gradients: $\nabla\mathcal S$.
        truth: $s$ [m].
        normals: $n$, the gradients of $s$.
        value_weight: $\lambda$ [1/m].
        eikonal_weight: $\mu_e$; 0.15 in the paper.

    Source: Li et al., "SwinGar", 2023, Eqs. 8 and 9. Differs: $\lambda$, 1 there.
    """
    turned = _lengths(gradients - normals).mean()
    eikonal = ((_lengths(gradients) - 1) ** 2).mean()
    return value_weight * (distances - truth).abs().mean() + turned + eikonal_weight * eikonal


def _lengths(vectors: torch.Tensor) -> torch.Tensor:
    return ((vectors**2).sum(dim=1) + 1e-8).sqrt()
