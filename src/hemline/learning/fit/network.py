"""A network of two hidden layers during training, with torch; at run time it is an `mlp.Mlp`."""

import itertools
import math
from collections.abc import Sequence

import numpy as np
import torch

from hemline.arrays import Float
from hemline.learning.mlp import Mlp
from hemline.learning.ridge import ridge

from .batches import SMALLEST_DEVIATION
from .linear_start import as_network

Layers = list[tuple[torch.Tensor, torch.Tensor]]
"""Weights (outs, ins) and biases (outs,) of each layer."""


class ScaledNetwork:
    r"""$y = s\,f((x - m) / d)$: a rectified network $f$ whose inputs and outputs are near unit size.

    $m$ and $d$ are mean and standard deviation of the training inputs; $s$ is given.
    """

    def __init__(
        self, inputs: Float[np.ndarray, "frames ins"], scale: Float[np.ndarray, " outs"], *, hidden: int, seed: int
    ):
        """Draws the weights.

        Args:
            inputs: The inputs of the training set, float32.
            scale: $s$, float32.
            hidden: Neurons in each of the two hidden layers.
            seed: Seed of the weights.
        """
        self.mean = inputs.mean(axis=0)
        self.spread = deviations_of(inputs)
        self.scale = scale
        generator = torch.Generator().manual_seed(seed)
        self.layers = random_layers((inputs.shape[1], hidden, hidden, len(scale)), generator)

    @property
    def parameters(self) -> list[torch.Tensor]:
        """Weights and biases, layer by layer."""
        return [parameter for layer in self.layers for parameter in layer]

    def __call__(self, inputs: torch.Tensor) -> torch.Tensor:
        """Returns the outputs (frames, outs) for inputs (frames, ins)."""
        value = (inputs - torch.from_numpy(self.mean)) / torch.from_numpy(self.spread)
        return through(self.layers, value) * torch.from_numpy(self.scale)

    def start_linear(
        self,
        inputs: Float[np.ndarray, "frames ins"],
        outputs: Float[np.ndarray, "frames outs"],
        noise: Float[np.ndarray, " ins"],
    ) -> None:
        """Initialises the network as the ridge regression on inputs with this noise; see `linear_start`."""
        matrix, offset = ridge((inputs - self.mean) / self.spread, outputs / self.scale, noise / self.spread)
        as_network(matrix, offset, [(w.detach().numpy(), b.detach().numpy()) for w, b in self.layers])

    def start_at_zero(self) -> None:
        """Initialises the network with outputs of zero for all inputs."""
        with torch.no_grad():
            self.layers[-1][0].zero_()

    def to_mlp(self) -> Mlp:
        """Returns the run-time network: scales are folded into the first and last layer, weights rounded to 16 bits."""
        weights = [layer[0].detach().numpy().astype(np.float64) for layer in self.layers]
        biases = [layer[1].detach().numpy().astype(np.float64) for layer in self.layers]
        biases[0] = biases[0] - weights[0] @ (self.mean / self.spread)
        weights[0] = weights[0] / self.spread
        weights[-1] = weights[-1] * self.scale[:, None]
        biases[-1] = biases[-1] * self.scale
        return Mlp.from_weights(weights, biases)


def deviations_of(inputs: Float[np.ndarray, "frames ins"]) -> Float[np.ndarray, " ins"]:
    """Returns the standard deviation of each input [m], float32, at least `SMALLEST_DEVIATION`."""
    return np.maximum(inputs.std(axis=0), SMALLEST_DEVIATION).astype(np.float32)


def through(layers: Layers, value: torch.Tensor) -> torch.Tensor:
    """Returns the outputs of all layers for inputs (frames, ins), rectified between layers."""
    for i, (weight, bias) in enumerate(layers):
        value = torch.nn.functional.linear(value, weight, bias)
        value = torch.relu(value) if i < len(layers) - 1 else value
    return value


def random_layers(sizes: Sequence[int], generator: torch.Generator) -> Layers:
    r"""Draws weights evenly within $\pm\sqrt{6 / \mathrm{ins}}$; biases are zero.

    Source: He, Zhang, Ren, Sun, "Delving Deep into Rectifiers", 2015, Section 2.2.
    """
    layers = []
    for ins, outs in itertools.pairwise(sizes):
        weight = (torch.rand((outs, ins), generator=generator) * 2 - 1) * math.sqrt(6 / ins)
        layers.append((weight.requires_grad_(), torch.zeros(outs).requires_grad_()))
    return layers
