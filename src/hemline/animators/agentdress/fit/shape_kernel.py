"""The effect of body shape in any pose: kernel ridge regression over pose and shape together, per region."""

from dataclasses import dataclass

import numpy as np

from hemline.animators.agentdress.pose_model import invert_definite, kernel, leave_groups_out
from hemline.animators.agentdress.shape_samples import SHAPE_LENGTH_SCALE, kernel_over_shapes
from hemline.arrays import Float, Int
from hemline.learning.compensated_rounding import PackedWeights, round_to_digits

from .leave_one_out import leave_one_out_mm

SHAPE_WIDTHS = (1.0, 1.4, 2.0, 3.0)
"""Candidate kernel widths, relative to the median distance between anchors."""

SHAPE_RIDGES = (0.3, 1.0, 3.0, 10.0)
"""Candidate ridge penalties [squared betas]."""


MOST_SEARCHED = 900
"""Most bodies with which width and ridge are searched; of more, those in an even selection of poses are taken. Time
grows with the cube of their number."""


@dataclass(frozen=True)
class ShapeChanges:
    """Changes of the garment from the mean shape, the training data of the kernel.

    Attributes:
        poses: Pose in which each body was draped, ascending.
        coordinates: Shape of each body as scaled betas, see `shape_scale`.
        outputs: Change from the mean shape, as coefficients of a basis [m].
        groups: Group number of each body; a group is left out together and contains at least all bodies of a pose.
    """

    poses: Int[np.ndarray, " samples"]
    coordinates: Float[np.ndarray, "samples betas"]
    outputs: Float[np.ndarray, "samples outputs"]
    groups: Int[np.ndarray, " samples"]

    def at_most(self, count: int) -> "ShapeChanges":
        """Returns the bodies of an even selection of groups, about as many as asked for; all if there are no more."""
        if len(self.poses) <= count:
            return self
        groups = np.unique(self.groups)
        chosen = groups[:: -(-len(self.poses) // count)]
        kept = np.isin(self.groups, chosen)
        return ShapeChanges(self.poses[kept], self.coordinates[kept], self.outputs[kept], self.groups[kept])


@dataclass(frozen=True)
class ShapeKernelFit:
    r"""The regression $\sum_i \alpha_{g,i} K(D_g^{s_i}(\theta))\, k(\beta_i, \beta)$, which is 0 at $\beta = 0$.

    Attributes:
        width: Width of the kernel over poses.
        ridge: Penalty added to the diagonal.
        weights: Weight $\alpha$ of each body, per region.
        leave_one_out: Residual of each body in a fit without its group.
        packed: The same weights in 8 bits, for each region; empty if they are not rounded.
    """

    width: float
    ridge: float
    weights: Float[np.ndarray, "regions samples outputs"]
    leave_one_out: Float[np.ndarray, "regions samples outputs"]
    packed: tuple[PackedWeights, ...] = ()


def best_shape_kernel(
    distances: Float[np.ndarray, "poses regions poses"],
    changes: ShapeChanges,
    basis: Float[np.ndarray, "outputs rows"],
    regions: Float[np.ndarray, "verts regions"],
) -> tuple[ShapeKernelFit, float]:
    """Fits the kernel with the width and ridge of least leave-one-out error; returns the fit and its error [mm].

    Width and ridge are searched with `MOST_SEARCHED` bodies at most. The weights are rounded to 8 bits.

    Args:
        distances: Squared distances between the poses, per region.
        changes: The training data.
        basis: Modes of the garment, one per row.
        regions: Weight of each region at each vertex.
    """
    some = changes.at_most(MOST_SEARCHED)

    def attempt(width: float, ridge: float) -> tuple[float, ShapeKernelFit]:
        candidate = fit_shape_kernel(distances, some, width=width, ridge=ridge)
        return leave_one_out_mm(candidate.leave_one_out, basis, regions), candidate

    attempts = (attempt(width, ridge) for width in SHAPE_WIDTHS for ridge in SHAPE_RIDGES)
    _, best = min(attempts, key=lambda each: each[0])
    best = fit_shape_kernel(distances, changes, width=best.width, ridge=best.ridge, rounded=True)
    return best, leave_one_out_mm(best.leave_one_out, basis, regions)


def fit_shape_kernel(
    distances: Float[np.ndarray, "poses regions poses"],
    changes: ShapeChanges,
    *,
    width: float,
    ridge: float,
    rounded: bool = False,
) -> ShapeKernelFit:
    r"""Fits a ridge regression with the kernel $K(D(\theta, \theta'))\, k(\beta, \beta')$; see `kernel_over_shapes`.

    Leave-one-out residuals follow from the diagonal blocks of the inverse.

    Args:
        distances: Squared distances between the poses, per region.
        changes: The training data.
        width: Width of the kernel over poses.
        ridge: Penalty added to the diagonal.
        rounded: Whether weights are rounded to 8 bits, as a model file stores them; see `round_to_digits`.

    Source: replaces Eq. 4, the blend of the nearest anchors, in Wu et al., "AgentDress: Realtime Clothing Synthesis for
        Virtual Agents using Plausible Deformations", 2021, whose section 6 leaves a joint treatment of pose and shape
        to future work.
    """
    poses, outputs, identity = changes.poses, changes.outputs, np.eye(len(changes.poses))
    between = kernel_over_shapes(changes.coordinates, changes.coordinates, SHAPE_LENGTH_SCALE)
    weights, residuals, packed = [], [], []
    for region in range(distances.shape[1]):
        gram = kernel(distances[:, region].astype(np.float64), width)[np.ix_(poses, poses)] * between
        inverse = invert_definite(gram + ridge * identity)
        solved = inverse @ outputs
        residuals.append(leave_groups_out(inverse, solved, changes.groups))
        if rounded:
            packed.append(round_to_digits(solved, inverse))
            solved = packed[-1].weights
        weights.append(solved)
    return ShapeKernelFit(width, ridge, np.stack(weights), np.stack(residuals), tuple(packed))
