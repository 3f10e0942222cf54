"""The terms of the training loss."""

from dataclasses import dataclass

import torch
from torch import Tensor

from hemline.options import check_options, not_negative

GRAVITY = 9.8
"""Acceleration of gravity [m/s^2]."""
SMALL_SQUARE = 1e-8
"""Number added to squared distances, so that a distance of zero has a gradient [m^2]."""


@dataclass(frozen=True)
class LossWeights:
    """Weights of the loss terms.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Section IV: 50, 10, 3, 0.2 and 1.5. Differs: the terms here are means,
        and the vertex term is a distance, so those weights would not balance them: with 3, the gradient of the bending
        term was 25 to 100 times that of the vertex term, and meshes became smoother than the simulation.
    """

    vertex: float = not_negative(3.0)
    """Weight of the mean distance. At 30 mm its gradient is that of 50 times the mean square."""
    edge: float = not_negative(50.0)
    """Weight of `edge_loss`."""
    bend: float = not_negative(0.03)
    """Weight of `bend_loss`."""
    gravity: float = not_negative(0.02)
    """Weight of `gravity_loss`."""
    collision: float = not_negative(50.0)
    """Weight of `collision_loss`."""

    def __post_init__(self) -> None:
        check_options(self, "weight of a loss")


def distance_loss(vertices: Tensor, truth: Tensor) -> Tensor:
    r"""$\frac1N \sum_i \lVert X_i - X_i^* \rVert$ [m], mean over frames.

    Args:
        vertices: Predicted vertices (frames, verts, 3) [m].
        truth: Simulated vertices (frames, verts, 3) [m].

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Eq. 11. Differs: the distance, not its square, since a loose
        garment has several truths in the same motion that lie far apart.
    """
    return ((vertices - truth).square().sum(-1) + SMALL_SQUARE).sqrt().mean()


def edge_loss(vertices: Tensor, truth: Tensor, edges: Tensor) -> Tensor:
    """Returns the mean square difference of the lengths of edges [m^2].

    Args:
        vertices: Predicted vertices (frames, verts, 3) [m].
        truth: Simulated vertices (frames, verts, 3) [m].
        edges: Vertex ids (edges, 2), int64.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Eq. 12, first term. Differs: the mean, so that a garment of many
        edges counts as one of few.
    """
    return (_lengths(vertices, edges) - _lengths(truth, edges)).square().mean()


def bend_loss(vertices: Tensor, faces: Tensor, beside: Tensor) -> Tensor:
    r"""Returns the mean of $\lVert \Delta N \rVert^2$: how far face normals are from the mean of their neighbours.

    Args:
        vertices: Predicted vertices (frames, verts, 3) [m].
        faces: Triangles as vertex ids (faces, 3), int64.
        beside: Ids of two faces that share an edge (pairs, 2), int64.

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Eq. 12, second term; Bertiche, Madadi, Escalera, "PBNS", 2021.
        Differs: the mean over faces; the Laplacian has equal weights.
    """
    corners = vertices[:, faces]
    normals = torch.linalg.cross(corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0])
    normals = torch.nn.functional.normalize(normals, dim=-1, eps=1e-12)
    pairs = torch.cat([beside, beside.flip(1)])
    count = normals.new_zeros(len(faces)).index_add_(0, pairs[:, 0], normals.new_ones(len(pairs)))
    around = torch.zeros_like(normals).index_add(1, pairs[:, 0], normals[:, pairs[:, 1]])
    return (normals - around / count.clamp(min=1)[:, None])[:, count > 0].square().sum(-1).mean()


def gravity_loss(vertices: Tensor, mass: Tensor) -> Tensor:
    r"""Potential energy $-\sum_i m_i\, x_i \cdot g$ [J] with $g$ along $-y$, mean over frames.

    Args:
        vertices: Predicted vertices (frames, verts, 3) [m].
        mass: Mass of each vertex (verts,) [kg].

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Eq. 13, in axes with y up.
    """
    return GRAVITY * (vertices[..., 1] @ mass).mean()


def collision_loss(heights: Tensor, margin: float) -> Tensor:
    r"""Mean of $\min(h - \epsilon, 0)^2$ [m^2].

    Args:
        heights: Signed distance of each vertex to the body, negative inside (frames, verts) [m].
        margin: $\epsilon$ [m].

    Source: Li, Shi, Zhu, Kanai, "SwinGar", 2023, Eq. 14, the distance being that of the neural SDF. Differs: the mean
        over vertices.
    """
    return (heights - margin).clamp(max=0).square().mean()


def _lengths(vertices: Tensor, edges: Tensor) -> Tensor:
    return torch.linalg.vector_norm(vertices[:, edges[:, 0]] - vertices[:, edges[:, 1]], dim=-1)
