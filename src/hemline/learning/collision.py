"""The collision term of a training: the distance that vertices lack to be clear of the body."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.arrays import BodyVertices, Float, FramesOfVertices, Vertices

TERM_DISTANCE = 0.08
"""Vertices farther from the skin than this in the ground truth have no term [m]."""
LEAST_TRUE_HEIGHT = -0.002
"""Vertices lower than this in the ground truth have no term, because the body cuts through itself there [m]."""


@dataclass(frozen=True)
class Clearances:
    r"""The body around each vertex of the ground truth in each frame, as a half-space.

    With the nearest body vertex $p$ of a true vertex $x^*$ and the normal $n$ there, a point $x$ is taken to lie
    $h + n \cdot (x - x^*)$ above the skin, $h = n \cdot (x^* - p)$.
    """

    normals: Float[np.ndarray, "frames verts 3"]
    """$n$ in the key frame, float16; may be mapped from disk."""
    heights: Float[np.ndarray, "frames verts"]
    """$h$ [m], float16; infinite where there is no term."""

    def rows(self, frames: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns normals and heights of some frames at some vertices, float32."""
        at = (frames[:, None], vertices)
        return self.normals[at].astype(np.float32), self.heights[at].astype(np.float32)


def clearance(
    truth: Vertices, body_vertices: BodyVertices, body_normals: BodyVertices
) -> tuple[Float[np.ndarray, "verts 3"], Float[np.ndarray, " verts"]]:
    """Returns normals and heights of one frame, see `Clearances`.

    Args:
        truth: The garment in the ground truth [m].
        body_vertices: The body in the same frame and space [m].
        body_normals: Unit normals of the body.
    """
    from scipy.spatial import KDTree

    nearest = KDTree(body_vertices).query(truth, distance_upper_bound=TERM_DISTANCE)[1]
    near = nearest < len(body_vertices)
    nearest = np.where(near, nearest, 0)
    normals = body_normals[nearest]
    heights = np.einsum("vi,vi->v", normals, truth - body_vertices[nearest])
    near &= heights >= LEAST_TRUE_HEIGHT
    return np.where(near[:, None], normals, 0), np.where(near, heights, np.inf)


def clearances(frames: FramesOfVertices, bodies: Sequence[BodyVertices], normals: Sequence[BodyVertices]) -> Clearances:
    """Returns the half-spaces of several frames; see `clearance`."""
    each = [clearance(*frame) for frame in zip(frames, bodies, normals, strict=True)]
    return Clearances(*(np.stack(column).astype(np.float16) for column in zip(*each, strict=True)))


def shortfall(offsets: Any, normals: Any, heights: Any, expansion: float) -> Any:
    r"""Returns the distance that each vertex lacks to be clear of the body by `expansion` [m], at least 0.

    $\max(0, \epsilon - h - n \cdot (x - x^*))$; the loss is its square. NumPy arrays or tensors.

    Args:
        offsets: $x - x^*$, (..., 3) [m].
        normals: $n$, (..., 3).
        heights: $h$, (...,) [m].
        expansion: $\epsilon$ [m].

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 and 9. Differs: they push a vertex that lies inside an expanded primitive towards
        the ground truth. Primitives are off by more than the 3 mm at which cloth rests on the skin, so where it
        matters most the ground truth itself lies inside them and gives no direction. A half-space of the mesh needs no
        search, is on the right side of thin parts, and has the normal as its gradient.
    """
    return (expansion - heights - (offsets * normals).sum(-1)).clip(0)


def collision_loss(
    offsets: Any, clearances: Clearances, frames: np.ndarray, vertices: np.ndarray, expansion: float
) -> Any:
    """Returns the mean square `shortfall` of some vertices of some frames [m^2], a tensor.

    Args:
        offsets: Their positions less those in the ground truth (frames, vertices, 3) [m], a tensor.
        clearances: The half-spaces of all frames.
        frames: Numbers of the frames.
        vertices: Numbers of the vertices.
        expansion: Distance that vertices should keep from the body [m].
    """
    import torch

    normals, heights = (torch.from_numpy(each) for each in clearances.rows(frames, vertices))
    return (shortfall(offsets, normals, heights, expansion) ** 2).mean()
