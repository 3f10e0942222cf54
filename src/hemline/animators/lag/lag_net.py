"""The lag network at run time: what each vertex is told becomes its displacement, without torch."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hemline.animators.coarse.proxy_on_body import Cells
from hemline.arrays import Float

from .cell_kernels import gather_from_cells, average_cells
from .dense_kernels import dense


def layer_sizes(inputs: int, width: int) -> dict[str, tuple[int, int]]:
    """Inputs and outputs of each layer."""
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
    r"""Two layers on each vertex, one on the mean of each cell, one on each cell and the mean of all, one on what the
    vertex hears from the cells near it; rectified, each with a weight $W$ and a bias $b$:

    $$h = r(W_2 r(W_1 f)) \quad c = r(W_4 [r(W_3 \bar h), \overline{r(W_3 \bar h)}]) \quad u = W_6 r(W_5 [h, S c])$$

    $f$ are the features of a vertex, $\bar h$ means of cells, $S$ the shares of the cells near it, $u$ its displacement
    from where skinning puts it, in its turned frame [m].
    """

    weights: Mapping[str, Float[np.ndarray, "inputs outputs"]]
    biases: Mapping[str, Float[np.ndarray, " outputs"]]

    def static(self, features: Float[np.ndarray, "verts static"]) -> Float[np.ndarray, "verts width"]:
        """The part of the first layer that does not change from frame to frame."""
        return features @ self.weights["first"][: features.shape[1]] + self.biases["first"]

    def displacements(
        self, static: Float[np.ndarray, "verts width"], told: Float[np.ndarray, "verts dynamic"], cells: Cells
    ) -> Float[np.ndarray, "verts 3"]:
        """Displacements of one frame, in the turned frames [m]."""
        h = _dense(told, self.weights["first"][-told.shape[1] :], static)
        h = self._layer("second", h)
        means = np.empty((cells.count, h.shape[1]), np.float32)
        average_cells(h, cells.cell, means)
        c = self._layer("cell", means)
        c = self._layer("all_cells", np.concatenate([c, np.broadcast_to(c.mean(axis=0), c.shape)], axis=1))
        # what is heard is linear in the cells, so their part of the layer is done before it is shared out
        width, third = h.shape[1], self.weights["third"]
        told_by_cells = _dense(c, third[width:], np.zeros((1, width), np.float32), rectified=False)
        heard = np.empty_like(h)
        gather_from_cells(told_by_cells, cells.near, cells.shares, self.biases["third"], heard)
        h = _dense(h, third[:width], heard)
        return _dense(h, self.weights["fourth"], self.biases["fourth"][None], rectified=False)

    def _layer(self, name: str, inputs: np.ndarray) -> np.ndarray:
        return _dense(inputs, self.weights[name], self.biases[name][None])


def _dense(inputs: np.ndarray, weights: np.ndarray, start: np.ndarray, *, rectified: bool = True) -> np.ndarray:
    """`start + inputs weights`, rectified or not."""
    out = np.empty((len(inputs), weights.shape[1]), np.float32)
    dense(inputs, weights, start, rectified, out)
    return out
