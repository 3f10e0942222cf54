"""Inputs of the network: the point in the frames of the pelvis or of all bones, and shape and pose."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Self

import numpy as np

from hemline.arrays import Betas, Float, Points, Quaternions, Transforms
from hemline.motions import JOINT_NAMES
from hemline.motions.quaternions import to_matrix

from .capsules import BoneCapsules
from .neural_sdf_kernels import LENGTH_SCALE, bone_features

if TYPE_CHECKING:
    from hemline.bodies import PosedBody

Inputs = Literal["bones", "point"]
"""`point`: the point in the frame of the pelvis, as in the paper. `bones`: also in the frames of all bones."""
TEMPERATURE = 0.02
"""Temperature of the softmax over bones; the smaller, the more sharply the nearest one is preferred [m]."""
NEAREST = 3 + 4 * len(JOINT_NAMES)
"""Number of the feature that holds the soft distance to the capsules, times `LENGTH_SCALE`."""
WIDTHS: dict[Inputs, int] = {"point": 3, "bones": NEAREST + 2}
"""Number of features of a point."""


def condition(betas: Betas, rotations: Quaternions) -> Float[np.ndarray, " condition"]:
    """Returns the features of shape and pose: betas, and two columns of R - I of each joint but the pelvis, float32.

    Args:
        betas: All shape coefficients.
        rotations: Local rotations; the pelvis is not read.
    """
    turned = to_matrix(np.asarray(rotations[1:], np.float64)) - np.eye(3)
    return np.concatenate([betas, turned[:, :, :2].ravel()]).astype(np.float32)


@dataclass(frozen=True, eq=False)
class PointInputs:
    r"""The features of points around one posed body.

    $q_j = A_j^{-1} x - J_j$ is the point as joint $j$ carries it, in the rest pose; $h_j$ its distance from the capsule
    of that joint there; $w = \mathrm{softmax}(-h / \tau)$. The features are $q_0$; $5 w_j q_j$; $w_j$; the soft least
    $-5 \tau \log \sum_j e^{-h_j / \tau}$; $10 \sum_j w_j r_j$. Rigid motion of body and points changes none of them.
    """

    kind: Inputs
    """Which features are used; `point` uses the first three."""
    to_rest: Transforms
    """$A_j^{-1}$, float32, C-contiguous."""
    capsules: BoneCapsules
    """Capsules of the shape."""

    @classmethod
    def of(cls, kind: Inputs, posed: "PosedBody") -> Self:
        """Makes the inputs around a posed body."""
        return cls(kind, invert_transforms(posed.transforms), BoneCapsules.of(posed.shaped))

    def features(
        self, points: Points, *, jacobians: bool
    ) -> tuple[Float[np.ndarray, "points inputs"], Float[np.ndarray, "rows inputs 3"]]:
        """Returns the features of points, and their derivatives by the point, or no rows of these.

        Args:
            points: Points in the world [m].
            jacobians: Whether the derivatives are wanted.
        """
        points = np.ascontiguousarray(points, np.float32)
        rows = len(points) if jacobians else 0
        if self.kind == "point":
            turn, shift = self.to_rest[0, :, :3], self.to_rest[0, :, 3] - self.capsules.starts[0]
            return points @ turn.T + shift, np.broadcast_to(turn, (rows, 3, 3))
        features = np.empty((len(points), WIDTHS[self.kind]), np.float32)
        derivatives = np.empty((rows, WIDTHS[self.kind], 3), np.float32)
        shape = self.capsules.starts, self.capsules.ends, self.capsules.radii
        bone_features(points, self.to_rest, *shape, np.float32(TEMPERATURE), features, derivatives)
        return features, derivatives


def start(kind: Inputs, features: Any) -> Any:
    """Returns the distance that the network corrects: the soft distance to the capsules [m], or 0.

    It works on features and on their derivatives alike.

    Args:
        kind: Inputs of the network.
        features: Array of NumPy or of torch (..., inputs).
    """
    return features[..., NEAREST] / LENGTH_SCALE if kind == "bones" else 0.0


def invert_transforms(transforms: Transforms) -> Transforms:
    """Returns the inverses of rigid transforms, C-contiguous."""
    back = transforms[:, :, :3].transpose(0, 2, 1)
    return np.concatenate([back, -(back @ transforms[:, :, 3:])], axis=2)
