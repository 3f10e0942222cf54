"""The estimator in NumPy and compiled code, equal to the one that is trained within rounding."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from hemline.animators.coarse.features.descriptor import compress_eigenvalues
from hemline.animators.coarse.features.feature_kernels import displace
from hemline.animators.swingar.estimator_config import (
    CHANGE_FACTOR,
    CORRECTIVE_WIDTH,
    JOINTS,
    MESHES,
    EstimatorConfig,
    weight_shapes,
)
from hemline.animators.swingar.graph import Graph
from hemline.animators.swingar.kernel_inputs import LayerInputs
from hemline.arrays import Float, Vertices
from hemline.compiled import threads
from hemline.files.contents import array_of
from hemline.learning.product_kernels import add_product

from .layer import AttentionLayer
from .play_kernels import attend_condensed, fill_mesh_features, pass_gates, recall


@dataclass(frozen=True, eq=False)
class EncodedGarment:
    """A garment as the estimator encodes it once for all frames."""

    graph: Graph
    """Graph of the garment."""
    positions: Vertices
    """Vertices at rest [m]."""
    features: Float[np.ndarray, "joints verts motion"]
    """Graph features [1]."""
    shape: Float[np.ndarray, " joints"]
    """Shape features [1]."""
    logits: Float[np.ndarray, "verts joints"]
    """Logits of the skin weights."""


@dataclass(frozen=True, eq=False)
class RuntimeEstimator:
    """The estimator without torch, one frame at a time. `fit.estimator.Estimator` documents its parts."""

    config: EstimatorConfig
    """Sizes of the estimator."""
    arrays: Mapping[str, np.ndarray]
    """Weights by name, float32, C-contiguous. Those from a file have the precision of float16."""

    @classmethod
    def of(cls, config: EstimatorConfig, arrays: Mapping[str, np.ndarray], dtype: str = "float16") -> Self:
        """Reads the weights of a model file.

        Args:
            config: The sizes.
            arrays: Weights by their names in `Estimator.state_dict()`; others are ignored.
            dtype: Type of the weights.

        Raises:
            BadModel: An array is missing, of another type or shape, or not finite.
        """
        weights = {name: array_of(arrays, name, dtype, shape) for name, shape in weight_shapes(config).items()}
        return cls(config, {name: np.array(each, np.float32, order="C") for name, each in weights.items()})

    @cached_property
    def layers(self) -> dict[str, AttentionLayer]:
        """Attention layers by name."""
        names = {name.removesuffix(".vectors") for name in self.arrays if name.endswith(".vectors")}
        groups = {"mesh_gates": 4, "hidden_gates": 4}
        return {
            name: AttentionLayer.of(self.arrays, name, self.config.scale, groups.get(name)) for name in sorted(names)
        }

    def garment(
        self,
        graph: Graph,
        features: Float[np.ndarray, "verts 7"],
        descriptor: Float[np.ndarray, " descriptor"],
        skin_logits: Float[np.ndarray, "verts joints"],
    ) -> EncodedGarment:
        """Encodes a garment at rest; see `Estimator.garment`.

        Args:
            graph: Graph of the garment.
            features: Normal, position [m] and distance to the body [m] of each vertex.
            descriptor: Eigenvalues of the spectral descriptor [1].
            skin_logits: Logits of the skin weights, to which those of the dynamic weights are added.
        """
        features = np.ascontiguousarray(features, np.float32)
        encoded = self.layers["graph_second"](graph, self.layers["graph_first"](graph, features[None]))
        shape = np.ones(JOINTS, np.float32)
        if self.config.global_shape == "spectral":
            shape = self._dense_layers("shape", compress_eigenvalues(descriptor).astype(np.float32))
        elif self.config.global_shape == "pooled":
            shape = self._linear("shape", encoded.mean(0)).max(0)
        positions = np.ascontiguousarray(features[:, 3:6])
        return EncodedGarment(graph, positions, encoded, shape, np.ascontiguousarray(skin_logits, np.float32))

    def coarse(
        self,
        garment: EncodedGarment,
        motion: Float[np.ndarray, "poses 75"],
        transforms: Float[np.ndarray, "joints 3 4"],
        features: Float[np.ndarray, "verts features"] | None = None,
        turns: Float[np.ndarray, "verts 4"] | None = None,
    ) -> tuple[Vertices, Float[np.ndarray, "verts joints"], Vertices]:
        """Predicts the coarse mesh of one frame; see `Estimator.coarse`.

        Args:
            garment: The garment.
            motion: The last poses.
            transforms: Skinning transforms of the joints.
            features: Features of the vertices; None if the estimator has none.
            turns: Rotation of each vertex by skinning, wxyz; None if the estimator displaces no vertices.

        Returns:
            Vertices [m], dynamic weights [1], blend shape at rest [m].
        """
        c, extra, first = self.config, None, None
        if c.told:
            assert features is not None
            extra = (features - self.arrays["told_mean"]) / self.arrays["told_spread"]
            first = np.ascontiguousarray(extra[:, : c.state_told]) if c.state_told else None
        moved = self._motion_feature(np.asarray(motion, np.float32))
        mean, scores = self._state(garment, moved, first)
        logits = scores * garment.shape + garment.logits
        weights = np.exp(logits - logits.max(1, keepdims=True))
        weights /= weights.sum(1, keepdims=True)
        blend = self.layers["blend_first"](garment.graph, mean[None], extra=extra)
        around = self.layers["blend_second"](garment.graph, blend)
        weighting = self._linear("blend_motion", moved) if "blend_motion.weight" in self.arrays else moved
        blend = (self.arrays["blend_scale"] * (around @ weighting)).T
        vertices = _blend_skin(weights, np.asarray(transforms, np.float32), garment.positions + blend)
        if c.displacement:
            assert turns is not None
            out = np.empty_like(vertices)
            displace(vertices, np.asarray(turns, np.float32), self._displacements(mean, around, extra), out)
            vertices = out
        return vertices, weights, blend

    def _displacements(self, state: np.ndarray, around: np.ndarray, features: np.ndarray | None) -> np.ndarray:
        """Predicts the displacement of each vertex in its frame as rotated by skinning; see `Estimator`."""
        context = list(around) if self.config.context else []
        own = [] if features is None else [features]
        hidden = np.maximum(self._linear("displace_first", np.concatenate([state, *own, *context], axis=1)), 0)
        if self.config.context:
            right, bias = self._right["displace_second"], self.arrays["displace_second.bias"]
            of_vertex, of_all = np.split(right, 2)
            hidden = _product(hidden, of_vertex, hidden.mean(0) @ of_all + bias)
        else:
            hidden = self._linear("displace_second", hidden)
        return self._linear("displace", np.maximum(hidden, 0))

    def corrective(
        self,
        garment: EncodedGarment,
        meshes: Float[np.ndarray, "meshes verts 3"],
        joints: Float[np.ndarray, "meshes joints 3"],
        body: Float[np.ndarray, " body"],
    ) -> Vertices:
        """Predicts the corrective displacement of one frame [m]; see `Estimator.corrective`.

        Args:
            garment: The garment.
            meshes: The last three coarse meshes, the present one last [m].
            joints: Positions of the joints at the same times [m].
            body: Betas and axis-angles of the present pose.
        """
        graph, peepholes = garment.graph, self.arrays["peepholes"]
        meshes = meshes[-1:] + np.float32(CHANGE_FACTOR) * (meshes - meshes[-1:])
        count, width = graph.vertex_count, self.config.corrective
        features = np.empty((1, count, CORRECTIVE_WIDTH), np.float32)
        cell, hidden = np.zeros((count, width), np.float32), np.empty((1, count, width), np.float32)
        for step in range(MESHES):
            mesh, places = (np.ascontiguousarray(each[step], np.float32) for each in (meshes, joints))
            fill_mesh_features(mesh, places, features[0])
            gates = self.layers["mesh_gates"](graph, features)
            if step:
                gates += self.layers["hidden_gates"](graph, hidden)
            pass_gates(gates, peepholes, cell, hidden[0])
        feature = self._dense_layers("body", np.asarray(body, np.float32))
        out = self.layers["corrective_first"](graph, hidden, feature)
        return self.arrays["corrective_scale"] * self.layers["corrective_second"](graph, out)[0]

    @cached_property
    def _recurrent(self) -> np.ndarray:
        return np.ascontiguousarray(self.arrays["motion.weight_hh_l0"].T)

    @cached_property
    def _right(self) -> dict[str, np.ndarray]:
        """Weights of each linear layer as the right factor of a product (inputs, outputs)."""
        found = {name.removesuffix(".weight"): each for name, each in self.arrays.items() if name.endswith(".weight")}
        return {name: np.ascontiguousarray(each.T) for name, each in found.items()}

    @cached_property
    def _motion_right(self) -> np.ndarray:
        return np.ascontiguousarray(self.arrays["motion.weight_ih_l0"].T)

    def _motion_feature(self, motion: np.ndarray) -> np.ndarray:
        """Returns the last hidden state of the LSTM over the poses."""
        biases = self.arrays["motion.bias_ih_l0"] + self.arrays["motion.bias_hh_l0"]
        given = _product(motion, self._motion_right, biases)
        hidden = np.empty(self.config.motion, np.float32)
        recall(given, self._recurrent, hidden)
        return hidden

    def _state(
        self, garment: EncodedGarment, moved: np.ndarray, features: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the mean of the heads of the state (verts, state), and their terms of the logits (verts, joints)."""
        layer, graph, count = self.layers["state"], garment.graph, garment.graph.vertex_count
        extra = np.zeros((count, 0), np.float32) if features is None else features
        means = np.empty((min(threads(), JOINTS), count, self.config.state), np.float32)
        scores = np.empty((count, JOINTS), np.float32)
        inputs = LayerInputs(garment.features[None], moved[None], extra[None])
        vector = self.arrays["weight.weight"][0]
        attend_condensed(graph.rings, inputs, layer.kernel_weights, layer.rule, vector, means, scores)
        return means.sum(0), scores

    def _dense_layers(self, name: str, value: np.ndarray) -> np.ndarray:
        for i in (0, 2, 4):
            value = self._linear(f"{name}.{i}", value if i == 0 else np.maximum(value, 0))
        return value

    def _linear(self, name: str, value: np.ndarray) -> np.ndarray:
        bias = self.arrays[f"{name}.bias"]
        return value @ self._right[name] + bias if value.ndim == 1 else _product(value, self._right[name], bias)


def _product(left: np.ndarray, right: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Returns `start + left right`, by one thread: threads of BLAS wait for each other on a busy machine."""
    out = np.empty((len(left), right.shape[1]), np.float32)
    out[:] = start
    add_product(np.ascontiguousarray(left, np.float32), right, out)
    return out


def _blend_skin(weights: np.ndarray, transforms: np.ndarray, points: np.ndarray) -> np.ndarray:
    blended = (weights @ transforms.reshape(JOINTS, 12)).reshape(-1, 3, 4)
    return np.einsum("vij,vj->vi", blended[..., :3], points) + blended[..., 3]
