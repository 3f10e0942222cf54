"""The neural signed distance to a body at run time: float32, NumPy and compiled code, no torch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, get_args

import numpy as np

from hemline.arrays import Float, Points
from hemline.errors import BadModel
from hemline.files import read_tensors, write_tensors
from hemline.files.contents import AGAIN, array_of, entry

from .inputs import WIDTHS, Inputs, PointInputs, condition, start
from .neural_sdf_kernels import softplus

if TYPE_CHECKING:
    from hemline.bodies import Body, PosedBody

SHIPPED = Path(__file__).parents[2] / "models" / "anny24-sdf.safetensors"
LAYERS = ("point0", "point1", "point2", "body0", "body1", "body2", "fusion0", "fusion1")
"""Three layers for the point, three for shape and pose, two that join them; `fusion0` reads the point's half first."""
POINTS_PER_BATCH = 512
"""Points that pass the layers together, so that intermediate values stay in the cache."""

Layer = tuple[np.ndarray, np.ndarray]
"""Weights (outs, ins) and biases (outs,), float32."""


@dataclass(frozen=True, eq=False)
class NeuralSdf:
    r"""$\mathcal S(x)$: the signed distance to any shape of a body in any pose, negative inside.

    $p_3 = p_1 + \sigma(P_3\,\sigma(P_2 p_1))$, $p_1 = \sigma(P_1 f(x))$, likewise $c_3$ of shape and pose, and
    $\mathcal S = s_0(x) + F_2\,\sigma(F_1 [p_3, c_3])$, all with biases; $\sigma$ is softplus with $\beta = 100$.

    Source: Li et al., "SwinGar", 2023, Sections III-D and IV. Differs: negative inside; not only the translation but
        the whole rigid motion of the pelvis is removed; shape and pose are read once for all points of a frame; with
        `bones`, $f(x)$ is the point in the frames of the bones and $s_0(x)$ the distance to their capsules
        (`inputs.PointInputs`), with `point` $f(x) = x$ and $s_0 = 0$ as there.
    """

    body_name: str
    """The body it was trained for."""
    body_hash: str
    """Hash of that body; another body is refused."""
    inputs: Inputs
    """Features of a point that the network reads."""
    beta_range: tuple[float, float]
    """Lowest and highest shape coefficient that it was trained on."""
    layers: Mapping[str, Layer]
    """Layers by name, see `LAYERS`; weights hold values that float16 can hold."""
    figures: Mapping[str, Any] = field(default_factory=dict)
    """Results of the training, numbers with the unit in the name."""

    @property
    def width(self) -> int:
        """Neurons in a hidden layer; 512 in the paper."""
        return len(self.layers["point0"][1])

    def flops(self) -> tuple[int, int]:
        """Returns the floating point operations of the layers for the value at one point, and with gradient."""
        halves = self.layers["point0"][0].size + 3 * self.width**2 + self.width
        return 2 * halves, 4 * halves

    def check_body(self, body: "Body") -> None:
        """Raises BadModel if the network was trained for another body."""
        if body.hash != self.body_hash:
            what = f"this neural distance is of the body '{self.body_name}' with hash {self.body_hash}"
            cure = "use that body, or train one: python -m hemline.models.make.neural_sdf"
            raise BadModel(what, f"'{body.name}' with hash {body.hash}", cure)

    def at(self, posed: "PosedBody") -> "PosedSdf":
        """Returns the distance to one body in one pose.

        Raises:
            BadModel: The network was trained for another body.
        """
        self.check_body(posed.shaped.body)
        read = condition(posed.shaped.betas, posed.pose.rotations)[None]
        first = _apply_layer(self.layers["body0"], read)[0]
        third = first + _apply_layer(self.layers["body2"], _apply_layer(self.layers["body1"], first)[0])[0]
        weights, biases = self.layers["fusion0"]
        return PosedSdf(self, PointInputs.of(self.inputs, posed), third[0] @ weights[:, self.width :].T + biases)

    def save(self, path: str | Path) -> None:
        """Writes the file that `load_neural_sdf` reads.

        Raises:
            BadOutput: The path cannot be written.
        """
        arrays = {f"{name}.weight": layer[0].astype(np.float16) for name, layer in self.layers.items()}
        arrays |= {f"{name}.bias": layer[1] for name, layer in self.layers.items()}
        metadata = {
            "kind": "distance",
            "body": {"name": self.body_name, "hash": self.body_hash},
            "inputs": self.inputs,
            "beta_range": list(self.beta_range),
            "figures": dict(self.figures),
        }
        write_tensors(path, arrays, metadata)

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], metadata: Mapping[str, Any]) -> Self:
        """Makes a network from the contents of a file.

        Raises:
            BadModel: Something is missing, or layers do not fit together.
        """
        inputs, body = entry(metadata, "inputs", str), entry(metadata, "body", dict)
        if inputs not in get_args(Inputs):
            raise BadModel("inputs of a neural distance are 'bones' or 'point'", f"'{inputs}'", AGAIN)
        low_high = entry(metadata, "beta_range", list)
        if len(low_high) != 2 or not all(isinstance(each, (int, float)) for each in low_high):
            raise BadModel("'beta_range' of a neural distance must be two numbers", low_high, AGAIN)
        width = len(array_of(arrays, "point0.bias", "float32", (None,)))
        condition_width = array_of(arrays, "body0.weight", "float16", (width, None)).shape[1]
        ins = (WIDTHS[inputs], width, width, condition_width, width, width, 2 * width, width)
        layers = {}
        for name, size in zip(LAYERS, ins, strict=True):
            outs = 1 if name == "fusion1" else width
            weight = array_of(arrays, f"{name}.weight", "float16", (outs, size)).astype(np.float32)
            layers[name] = weight, array_of(arrays, f"{name}.bias", "float32", (outs,))
        names = entry(body, "name", str), entry(body, "hash", str)
        return cls(*names, inputs, (float(low_high[0]), float(low_high[1])), layers, entry(metadata, "figures", dict))


@dataclass(frozen=True, eq=False)
class PosedSdf:
    """A `NeuralSdf` around one posed body; a `Distance`."""

    model: NeuralSdf
    inputs: PointInputs
    """Features of points around the body."""
    code: Float[np.ndarray, " width"]
    """Contribution of shape and pose to the first layer of the fusion, its biases included."""

    def signed_distances(self, points: Points) -> Float[np.ndarray, " points"]:
        """Returns the signed distances of points [m], float32."""
        return self._through(points, gradients=False)[0]

    def with_gradients(self, points: Points) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, "points 3"]]:
        """Returns the signed distances of points [m] and their gradients by backpropagation, float32."""
        return self._through(points, gradients=True)

    def _through(self, points: Points, *, gradients: bool) -> tuple[np.ndarray, np.ndarray]:
        distances = np.empty(len(points), np.float32)
        slopes = np.empty((len(points) if gradients else 0, 3), np.float32)
        for first in range(0, len(points), POINTS_PER_BATCH):
            some = slice(first, first + POINTS_PER_BATCH)
            features, jacobians = self.inputs.features(points[some], jacobians=gradients)
            distances[some], to_features = self._layers(features, gradients=gradients)
            if gradients:
                slopes[some] = (to_features[:, None] @ jacobians)[:, 0]
                slopes[some] += start(self.model.inputs, jacobians.swapaxes(1, 2))
        return distances, slopes

    def _layers(self, features: np.ndarray, *, gradients: bool) -> tuple[np.ndarray, np.ndarray]:
        """Returns distances, and their derivatives by the features if `gradients`."""
        layers, width = self.model.layers, self.model.width
        joining, last = layers["fusion0"][0][:, :width], layers["fusion1"]
        p1, slope1 = _apply_layer(layers["point0"], features)
        p2, slope2 = _apply_layer(layers["point1"], p1)
        p3, slope3 = _apply_layer(layers["point2"], p2)
        p3 += p1
        joined, slope = _apply_layer((joining, self.code), p3)
        distances = joined @ last[0][0] + last[1] + start(self.model.inputs, features)
        if not gradients:
            return distances, features
        to_p3 = (slope * last[0][0]) @ joining
        to_p1 = ((to_p3 * slope3) @ layers["point2"][0] * slope2) @ layers["point1"][0] + to_p3
        return distances, (to_p1 * slope1) @ layers["point0"][0]


def _apply_layer(layer: Layer, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Applies one layer with softplus; returns its outputs and the derivative of the softplus."""
    sums = values @ layer[0].T
    sums += layer[1]
    slopes = np.empty_like(sums)
    softplus(sums.reshape(-1), slopes.reshape(-1))
    return sums, slopes


@lru_cache(maxsize=4)
def load_neural_sdf(path: str | Path = SHIPPED) -> NeuralSdf:
    """Loads the neural distance that ships for `anny24`, or one from a file; the result is cached.

    Raises:
        BadModel: The file is missing, damaged, of another kind, or its layers do not fit together.
    """
    return NeuralSdf.of(*read_tensors(path, "distance", error=BadModel))
