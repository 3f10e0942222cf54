"""The lag network at run time, without torch: it turns the features of vertices into displacements."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hemline.animators.coarse.proxy_on_body import Cells
from hemline.arrays import Float

from .cell_kernels import average_cells, gather_from_cells
from .dense_kernels import dense


def layer_sizes(inputs: int, width: int) -> dict[str, tuple[int, int]]:
    """Returns the numbers of inputs and outputs of each layer."""
    return {
        "first": (inputs, width),
        "second": (width, width),
        "cell": (width, width),
        "all_cells": (2 * width, width),
        "third": (2 * width, width),
        "fourth": (width, 3),
    }


@dataclass(frozen=True, eq=False)
class LagNet:
    r"""Two layers on each vertex, one on the mean of each cell, one on each cell and the mean of all cells, two on the
    vertex and the cells that reach it. All but the last are rectified; each has a weight $W$ and a bias $b$:

    $$h = r(W_2 r(W_1 f)) \quad c = r(W_4 [r(W_3 \bar h), \overline{r(W_3 \bar h)}]) \quad u = W_6 r(W_5 [h, S c])$$

    $f$ are the features of a vertex, $\bar h$ the means of cells, $S$ the weights of the cells that reach the vertex,
    $u$ its displacement from skinning in its rotated frame [m].
    """

    weights: Mapping[str, Float[np.ndarray, "inputs outputs"]]
    """Weights by layer."""
    biases: Mapping[str, Float[np.ndarray, " outputs"]]
    """Biases by layer."""

    def static(self, features: Float[np.ndarray, "verts static"]) -> Float[np.ndarray, "verts width"]:
        """Computes the part of the first layer that does not change from frame to frame."""
        return features @ self.weights["first"][: features.shape[1]] + self.biases["first"]

    def displacements(
        self, static: Float[np.ndarray, "verts width"], features: Float[np.ndarray, "verts dynamic"], cells: Cells
    ) -> Float[np.ndarray, "verts 3"]:
        """Predicts the displacements of one frame, in the rotated frames of the vertices [m].

        Args:
            static: Result of the method `static`.
            features: Features that change from frame to frame.
            cells: Cells of the garment.
        """
        h = _dense(features, self.weights["first"][-features.shape[1] :], static)
        h = self._layer("second", h)
        means = np.empty((cells.count, h.shape[1]), np.float32)
        average_cells(h, cells.cell, means)
        c = self._layer("cell", means)
        c = self._layer("all_cells", np.concatenate([c, np.broadcast_to(c.mean(axis=0), c.shape)], axis=1))
        # gathering is linear, so that the part of the layer on cells can be computed once for each cell
        width, third = h.shape[1], self.weights["third"]
        of_cells = _dense(c, third[width:], np.zeros((1, width), np.float32), rectified=False)
        gathered = np.empty_like(h)
        gather_from_cells(of_cells, cells.near, cells.shares, self.biases["third"], gathered)
        h = _dense(h, third[:width], gathered)
        return _dense(h, self.weights["fourth"], self.biases["fourth"][None], rectified=False)

    def _layer(self, name: str, inputs: np.ndarray) -> np.ndarray:
        return _dense(inputs, self.weights[name], self.biases[name][None])


def _dense(inputs: np.ndarray, weights: np.ndarray, start: np.ndarray, *, rectified: bool = True) -> np.ndarray:
    """Returns `start + inputs weights`, rectified or not."""
    out = np.empty((len(inputs), weights.shape[1]), np.float32)
    dense(inputs, weights, start, rectified, out)
    return out
