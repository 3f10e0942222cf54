"""The collision term of a training: how far vertices are from being clear of the body."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hemline.arrays import BodyVertices, Float, FramesOfVertices, Vertices

REACH = 0.08
"""Vertices whose true place is farther than this from the skin have no term [m]."""
SUNK = -0.002
"""Nor have those whose true place is deeper inside than this: the body cuts through itself there [m]."""


@dataclass(frozen=True)
class Clearances:
    r"""The body as each vertex of the ground truth sees it in each frame: a half-space.

    With the nearest body vertex $p$ of a true vertex $x^*$ and the normal $n$ there, a point $x$ is taken to lie
    $h + n \cdot (x - x^*)$ above the skin, $h = n \cdot (x^* - p)$.
    """

    normals: Float[np.ndarray, "frames verts 3"]
    """$n$ in the key frame, float16; may be mapped from disk."""
    heights: Float[np.ndarray, "frames verts"]
    """$h$ [m], float16; infinite where there is no term."""

    def rows(self, frames: np.ndarray, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Normals and heights of some frames at some vertices, float32."""
        at = (frames[:, None], vertices)
        return self.normals[at].astype(np.float32), self.heights[at].astype(np.float32)


def clearance(
    truth: Vertices, body_vertices: BodyVertices, body_normals: BodyVertices
) -> tuple[Float[np.ndarray, "verts 3"], Float[np.ndarray, " verts"]]:
    """Normals and heights of one frame, see `Clearances`.

    Args:
        truth: The garment of the ground truth [m].
        body_vertices: The body in the same frame and space [m].
        body_normals: Its unit normals.
    """
    from scipy.spatial import KDTree

    nearest = KDTree(body_vertices).query(truth, distance_upper_bound=REACH)[1]
    found = nearest < len(body_vertices)
    nearest = np.where(found, nearest, 0)
    normals = body_normals[nearest]
    heights = np.einsum("vi,vi->v", normals, truth - body_vertices[nearest])
    found &= heights >= SUNK
    return np.where(found[:, None], normals, 0), np.where(found, heights, np.inf)


def clearances(frames: FramesOfVertices, bodies: Sequence[BodyVertices], normals: Sequence[BodyVertices]) -> Clearances:
    """The half-spaces of several frames; see `clearance`."""
    each = [clearance(*frame) for frame in zip(frames, bodies, normals, strict=True)]
    return Clearances(*(np.stack(column).astype(np.float16) for column in zip(*each, strict=True)))


def missing(offsets: Any, normals: Any, heights: Any, expansion: float) -> Any:
    r"""How much each vertex lacks to be clear of the body by `expansion` [m]; 0 where it lacks nothing.

    $\max(0, \epsilon - h - n \cdot (x - x^*))$; the loss is its square. NumPy arrays or tensors.

    Args:
        offsets: $x - x^*$, (..., 3) [m].
        normals: $n$, (..., 3).
        heights: $h$, (...,) [m].
        expansion: $\epsilon$ [m].

    Source: Jin, Omens, Geng, Teran, Kumar, Tashiro, Fedkiw, "A Neural-Network-Based Approach for Loose-Fitting
        Clothing", 2024, Sections 7 and 9. Differs: they push a vertex that lies inside an expanded primitive towards
        the ground truth. Primitives are off by more than the 3 mm at which cloth rests on the skin, so where it
        matters most the ground truth itself lies inside them and nothing is left to be said. A half-space of the mesh
        there costs no search, is on its side of thin parts, and its gradient is along the normal.
    """
    return (expansion - heights - (offsets * normals).sum(-1)).clip(0)


def collision_loss(
    offsets: Any, clearances: Clearances, frames: np.ndarray, vertices: np.ndarray, expansion: float
) -> Any:
    """Mean square of what some vertices of some frames lack [m^2], a tensor; see `missing`.

    Args:
        offsets: Where they are, less where they are in the ground truth (frames, vertices, 3) [m], a tensor.
        clearances: The half-spaces of all frames.
        frames: Which frames.
        vertices: Which vertices.
        expansion: Distance that they should keep from the body [m].
    """
    import torch

    normals, heights = (torch.from_numpy(each) for each in clearances.rows(frames, vertices))
    return (missing(offsets, normals, heights, expansion) ** 2).mean()
