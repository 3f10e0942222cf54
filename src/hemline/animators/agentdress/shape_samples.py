"""What the shape of the body adds, as it is kept: for each body that was settled, what it counts for."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of

from .shape_model import pad_betas

SQUARE_WEIGHT = 0.5
"""What the square of a beta counts for beside the beta."""


SHAPE_LENGTH_SCALE = 10.0
"""How far apart two bodies still tell much of each other."""


def kernel_over_shapes(
    betas: Float[np.ndarray, "bodies betas"], others: Float[np.ndarray, "others betas"], reach: float
) -> Float[np.ndarray, "bodies others"]:
    r"""The kernel over shapes, nothing where one of them is the mean one.

    $l^2 (k(\beta - \beta') - k(\beta)\, k(\beta'))$, $k(\beta) = 1 / (1 + |\beta|^2 / l^2)$: that of a Gaussian process
    with the kernel k, once it is known to be 0 at the mean shape.

    Args:
        betas: Some shapes.
        others: Other shapes, with as many betas.
        reach: $l$; 0: the products of $(\beta, s \beta^2)$ instead, as linear and square effects have them.
    """
    first, second = betas.astype(np.float64), others.astype(np.float64)
    products = first @ second.T
    if reach == 0:
        return products + SQUARE_WEIGHT**2 * (first**2 @ (second**2).T)
    one, other = (first**2).sum(axis=1)[:, None], (second**2).sum(axis=1)
    apart, area = one + other - 2 * products, reach**2
    return area * (1 / (1 + apart / area) - 1 / ((1 + one / area) * (1 + other / area)))


@dataclass(frozen=True, eq=False)
class ShapeSamples:
    r"""$E_{g,s}(\beta) = \sum_{i: s_i = s} \alpha_{g,i}\, k(S \beta_i, S \beta)$.

    Attributes:
        poses: In which pose each body was settled, rising.
        betas: Its shape.
        weights: $\alpha$, by region; one region stands for all where they do not differ.
        scale: $S$, see `shape_scale`; the identity where betas count alike.
        reach: Of the kernel $k$, `kernel_over_shapes`.
    """

    poses: Int[np.ndarray, " samples"]
    betas: Float[np.ndarray, "samples betas"]
    weights: Float[np.ndarray, "shape_regions samples shape_modes"]
    scale: Float[np.ndarray, "betas betas"]
    length_scale: float = SHAPE_LENGTH_SCALE

    @property
    def pose_count(self) -> int:
        """Poses, the first ones of the model, at which something is added."""
        return int(self.poses[-1]) + 1

    @classmethod
    def of_effects(cls, effects: Float[np.ndarray, "features shape_regions poses shape_modes"]) -> Self:
        r"""Those that add given multiples of $(\beta, \beta^2)$: for each beta a body at 1 and one at -1."""
        known, _, poses, _ = (count // 2 if axis == 0 else count for axis, count in enumerate(effects.shape))
        linear, square = effects[:known], effects[known:] / SQUARE_WEIGHT**2
        weights = np.concatenate([square + linear, square - linear]) / 2
        bodies = np.concatenate([np.eye(known), -np.eye(known)])
        return cls(
            np.repeat(np.arange(poses, dtype=np.int32), 2 * known),
            np.tile(bodies, (poses, 1)).astype(np.float32),
            weights.transpose(1, 2, 0, 3).reshape(effects.shape[1], -1, effects.shape[3]).astype(np.float32),
            np.eye(known, dtype=np.float32),
            reach=0.0,
        )

    def select_poses(self, of: Int[np.ndarray, " poses"]) -> Self:
        """Those of some poses in turn, as often as they are named."""
        rows = [np.flatnonzero(self.poses == pose) for pose in of]
        numbers = np.repeat(np.arange(len(of), dtype=np.int32), [len(each) for each in rows])
        order = np.concatenate(rows)
        return replace(self, poses=numbers, betas=self.betas[order], weights=self.weights[:, order])

    def in_half_precision(self) -> Self:
        """As a model file keeps them: weights in half precision."""
        return replace(self, weights=self.weights.astype(np.float16).astype(np.float32))

    def effects(self, betas: Float[np.ndarray, " betas"]) -> Float[np.ndarray, "shape_regions poses shape_modes"]:
        """What a shape adds to each direction at each pose, by region, float32."""
        query = pad_betas(betas[None], self.betas.shape[1])
        shares = kernel_over_shapes(self.betas @ self.scale, query @ self.scale, self.length_scale)[:, 0].astype(np.float32)
        firsts = np.flatnonzero(np.diff(self.poses, prepend=-1))
        found = np.zeros((len(self.weights), self.pose_count, self.weights.shape[2]), np.float32)
        found[:, self.poses[firsts]] = np.add.reduceat(self.weights * shares[:, None], firsts, axis=1)
        return found

    def arrays(self) -> dict[str, np.ndarray]:
        """What a model file holds; weights in half precision."""
        weights = self.weights.astype(np.float16)
        held = {"poses": self.poses, "betas": self.betas, "weights": weights, "scale": self.scale}
        return held | {"reach": np.array([self.length_scale], np.float32)}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, poses: int, regions: int) -> Self:
        """Read them back.

        Raises:
            BadModel: An array is missing or of another shape, or names a pose that does not exist.
        """
        held = array_of(arrays, "poses", "int32", (None,))
        weights = array_of(arrays, "weights", "float16", (None, len(held), None))
        if not (len(held) and held[0] >= 0 and (np.diff(held) >= 0).all() and held[-1] < poses):
            raise BadModel("bodies are in poses of the model, in rising order", str(held[:8]), AGAIN)
        if len(weights) not in (1, regions):
            raise BadModel("what the shape adds is told for each region, or for all", len(weights), AGAIN)
        betas, reach = (
            array_of(arrays, "betas", "float32", (len(held), None)),
            array_of(arrays, "reach", "float32", (1,)),
        )
        scale = array_of(arrays, "scale", "float32", (betas.shape[1], betas.shape[1]))
        if not (np.isfinite(reach[0]) and reach[0] >= 0 and np.isfinite(scale).all()):
            raise BadModel("the kernel over shapes has a finite reach and scale", float(reach[0]), AGAIN)
        return cls(held, betas, weights.astype(np.float32), scale, float(reach[0]))
