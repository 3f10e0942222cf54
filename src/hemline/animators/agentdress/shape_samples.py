"""The effect of the body shape on the garment, stored as kernel weights of the draped bodies."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from hemline.arrays import Float, Int
from hemline.errors import BadModel
from hemline.files.contents import AGAIN, array_of
from hemline.learning.compensated_rounding import grid

from .shape_model import pad_betas

SQUARE_WEIGHT = 0.5
"""Weight of a squared beta relative to the beta."""

SHAPE_LENGTH_SCALE = 10.0
"""Length scale of the kernel over body shapes."""


def kernel_over_shapes(
    betas: Float[np.ndarray, "bodies betas"], others: Float[np.ndarray, "others betas"], length_scale: float
) -> Float[np.ndarray, "bodies others"]:
    r"""Returns the kernel between shapes; it is 0 if one of them is the mean shape.

    $l^2 (k(\beta - \beta') - k(\beta)\, k(\beta'))$, $k(\beta) = 1 / (1 + |\beta|^2 / l^2)$: the kernel of a Gaussian
    process with kernel $k$, conditioned to be 0 at the mean shape.

    Args:
        betas: Some shapes.
        others: Other shapes, with as many betas.
        length_scale: $l$. 0 selects the products of $(\beta, s \beta^2)$, the kernel of linear and square effects.
    """
    first, second = betas.astype(np.float64), others.astype(np.float64)
    products = first @ second.T
    if length_scale == 0:
        return products + SQUARE_WEIGHT**2 * (first**2 @ (second**2).T)
    one, other = (first**2).sum(axis=1)[:, None], (second**2).sum(axis=1)
    distance, area = one + other - 2 * products, length_scale**2
    return area * (1 / (1 + distance / area) - 1 / ((1 + one / area) * (1 + other / area)))


@dataclass(frozen=True, eq=False)
class ShapeSamples:
    r"""$E_{g,s}(\beta) = \sum_{i: s_i = s} \alpha_{g,i}\, k(S \beta_i, S \beta)$.

    Attributes:
        poses: Pose in which each body was draped, ascending.
        betas: Shape of each body.
        weights: $\alpha$ per region; a single region stands for all if they do not differ.
        scale: $S$, see `shape_scale`; the identity if all betas count alike.
        length_scale: Length scale of the kernel $k$, see `kernel_over_shapes`; saved as `reach`.
        sizes: Size of the weights of each garment, float16, if the weights are 8 bits, see `PackedWeights`; None if
            they are numbers of half precision.
        steps: Step of the weights of each mode, likewise.
    """

    poses: Int[np.ndarray, " samples"]
    betas: Float[np.ndarray, "samples betas"]
    weights: Float[np.ndarray, "shape_regions samples shape_modes"]
    scale: Float[np.ndarray, "betas betas"]
    length_scale: float = SHAPE_LENGTH_SCALE
    sizes: Float[np.ndarray, "shape_regions samples"] | None = None
    steps: Float[np.ndarray, "shape_regions shape_modes"] | None = None

    @property
    def pose_count(self) -> int:
        """Number of poses with draped bodies; they are the first ones of the model."""
        return int(self.poses[-1]) + 1

    @classmethod
    def of_effects(cls, effects: Float[np.ndarray, "features shape_regions poses shape_modes"]) -> Self:
        r"""Makes samples with given linear and square effects: for each beta a body at 1 and one at -1."""
        known, _, poses, _ = (count // 2 if axis == 0 else count for axis, count in enumerate(effects.shape))
        linear, square = effects[:known], effects[known:] / SQUARE_WEIGHT**2
        weights = np.concatenate([square + linear, square - linear]) / 2
        bodies = np.concatenate([np.eye(known), -np.eye(known)])
        return cls(
            np.repeat(np.arange(poses, dtype=np.int32), 2 * known),
            np.tile(bodies, (poses, 1)).astype(np.float32),
            weights.transpose(1, 2, 0, 3).reshape(effects.shape[1], -1, effects.shape[3]).astype(np.float32),
            np.eye(known, dtype=np.float32),
            length_scale=0.0,
        )

    def as_stored(self) -> Self:
        """Returns the samples as a model file stores them: weights that are not of 8 bits in half precision."""
        return (
            self
            if self.steps is not None
            else replace(self, weights=self.weights.astype(np.float16).astype(np.float32))
        )

    def effects(self, betas: Float[np.ndarray, " betas"]) -> Float[np.ndarray, "shape_regions poses shape_modes"]:
        """Returns the effect of a shape on each mode at each pose, per region, float32."""
        query = pad_betas(betas[None], self.betas.shape[1])
        kernel = kernel_over_shapes(self.betas @ self.scale, query @ self.scale, self.length_scale)[:, 0].astype(
            np.float32
        )
        firsts = np.flatnonzero(np.diff(self.poses, prepend=-1))
        result = np.zeros((len(self.weights), self.pose_count, self.weights.shape[2]), np.float32)
        result[:, self.poses[firsts]] = np.add.reduceat(self.weights * kernel[:, None], firsts, axis=1)
        return result

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the arrays of a model file, weights in half precision or as digits of 8 bits and their steps."""
        betas, bodies = np.unique(self.betas, axis=0, return_inverse=True)
        arrays = {"poses": self.poses, "betas": betas, "bodies": bodies.reshape(-1).astype(np.int32)}
        arrays |= {"scale": self.scale, "reach": np.array([self.length_scale], np.float32)}
        if self.sizes is None or self.steps is None:
            return arrays | {"weights": self.weights.astype(np.float16)}
        digits = np.rint(self.weights / grid(self.sizes, self.steps)).astype(np.int8)
        return arrays | {"weights": digits, "sizes": self.sizes, "steps": self.steps}

    @classmethod
    def of(cls, arrays: Mapping[str, np.ndarray], *, poses: int, regions: int) -> Self:
        """Reads the arrays of a model file.

        Raises:
            BadModel: An array is missing or has the wrong shape, or refers to a pose that does not exist.
        """
        poses_of = array_of(arrays, "poses", "int32", (None,))
        weights = array_of(arrays, "weights", ("float16", "int8"), (None, len(poses_of), None))
        sizes = steps = None
        if weights.dtype == np.int8:
            sizes = array_of(arrays, "sizes", "float16", weights.shape[:2])
            steps = array_of(arrays, "steps", "float32", (len(weights), weights.shape[2]))
            weights = weights * grid(sizes, steps)
        if not (len(poses_of) and poses_of[0] >= 0 and (np.diff(poses_of) >= 0).all() and poses_of[-1] < poses):
            raise BadModel("bodies are in poses of the model, in rising order", str(poses_of[:8]), AGAIN)
        if len(weights) not in (1, regions):
            raise BadModel("the effect of the shape is given for each region, or for all", len(weights), AGAIN)
        betas, reach = array_of(arrays, "betas", "float32", (None, None)), array_of(arrays, "reach", "float32", (1,))
        if "bodies" in arrays:
            each = array_of(arrays, "bodies", "int32", (len(poses_of),))
            if each.size and not (each.min() >= 0 and each.max() < len(betas)):
                raise BadModel("the model names a body that does not exist", int(each.max()), AGAIN)
            betas = betas[each]
        elif len(betas) != len(poses_of):
            raise BadModel("each garment of the model has betas", f"{len(betas)} of {len(poses_of)}", AGAIN)
        scale = array_of(arrays, "scale", "float32", (betas.shape[1], betas.shape[1]))
        if not (np.isfinite(reach[0]) and reach[0] >= 0 and np.isfinite(scale).all()):
            raise BadModel("the kernel over shapes has a finite reach and scale", float(reach[0]), AGAIN)
        return cls(poses_of, betas, weights.astype(np.float32), scale, float(reach[0]), sizes, steps)
