"""Moves vertices out of the body along the gradient of a distance, by the method of SwinGar and two others."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from hemline.arrays import Faces, Float, Int, Mask, Vertices
from hemline.errors import BadMesh
from hemline.meshes import edges

from .distance import Distance


@dataclass(frozen=True, eq=False)
class Neighbours:
    """The neighbours of each vertex of a garment, for Eq. 10."""

    pairs: Int[np.ndarray, "pairs 2"]
    """Vertices of each edge, once in either direction."""
    deviation: float
    """Standard deviation of the Gaussian over their distance, the mean edge length [m]."""

    @classmethod
    def of(cls, vertices: Vertices, faces: Faces) -> Self:
        """Collects the neighbours in a mesh.

        Args:
            vertices: The garment at rest [m].
            faces: Triangles of the garment.

        Raises:
            BadMesh: The mesh has no edge, or all have length zero.
        """
        each = edges(faces)
        ends = np.asarray(vertices, np.float64)[each]
        mean = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).mean()) if len(each) else 0.0
        if not mean > 0:
            cure = "give the garment's mesh at rest"
            raise BadMesh("neighbours need a mesh with edges", f"{len(each)} edges of mean length {mean} m", cure)
        return cls(np.concatenate([each, each[:, ::-1]]), mean)


@dataclass(frozen=True, eq=False)
class MovedGarment:
    """A garment moved out of the body."""

    vertices: Vertices
    """Vertices of the garment [m]."""
    moved: Mask
    """Whether each vertex was inside before, by the given distance."""


def push_out(vertices: Vertices, distance: Distance, neighbours: Neighbours) -> MovedGarment:
    r"""Moves each vertex inside by $\frac{\nabla\mathcal S}{|\nabla\mathcal S|}\,(|\mathcal S(x_i)| + \delta_i)$.

    $\delta_i = \sum_k w_k |\mathcal S(x_k)|$ over those neighbours that are not inside, with $w_k$ proportional to
    $\exp(-|x_i - x_k|^2 / 2\sigma^2)$ and sum 1, $\sigma$ the mean edge; 0 where all are inside.

    Args:
        vertices: The garment in this frame [m].
        distance: Distance to the body in this frame; inside is where it is negative.
        neighbours: Neighbours in the garment.

    Raises:
        BadMesh: A position is not finite, or the neighbours belong to another mesh.

    Source: Li et al., "SwinGar", 2023, Eq. 10. Differs: weights that sum to 1 are not divided by the number of
        neighbours once more; negative is inside.
    """
    if neighbours.pairs.max() >= len(vertices):
        what = f"neighbours of a mesh of at least {neighbours.pairs.max() + 1} vertices cannot be used"
        raise BadMesh(what, f"{len(vertices)} vertices", "make them from the faces of this garment")
    inside, depths, directions = _inside(vertices, distance)
    pairs = neighbours.pairs[inside[neighbours.pairs[:, 0]] & ~inside[neighbours.pairs[:, 1]]]
    squares = ((vertices[pairs[:, 0]] - vertices[pairs[:, 1]]) ** 2).sum(axis=1)
    least = np.full(len(vertices), np.inf)
    np.minimum.at(least, pairs[:, 0], squares)  # so that a sum of weights never vanishes
    weights = np.exp((least[pairs[:, 0]] - squares) / (2 * neighbours.deviation**2))
    total = np.bincount(pairs[:, 0], weights, len(vertices))
    clearance = np.bincount(pairs[:, 0], weights * depths[pairs[:, 1]], len(vertices)) / np.where(total > 0, total, 1)
    return _move(vertices, inside, directions, (depths + clearance)[inside])


def push_out_by_distance(vertices: Vertices, distance: Distance, amount: float) -> MovedGarment:
    """Moves each vertex inside by one fixed distance, which should be larger than all depths.

    Args:
        vertices: The garment in this frame [m].
        distance: Distance to the body in this frame.
        amount: The distance [m].

    Raises:
        BadMesh: A position is not finite.

    Source: the post-processing of Patel, Liao, Pons-Moll, "TailorNet", 2020, as Li et al., "SwinGar", 2023, Section V-B
        describe it.
    """
    inside, _, directions = _inside(vertices, distance)
    return _move(vertices, inside, directions, np.full(inside.sum(), amount))


def push_out_by_scale(vertices: Vertices, distance: Distance, scale: float) -> MovedGarment:
    r"""Moves each vertex inside by $\alpha\,|\mathcal S(x_i)|$ along the gradient.

    Args:
        vertices: The garment in this frame [m].
        distance: Distance to the body in this frame.
        scale: $\alpha$, at least 1.

    Raises:
        BadMesh: A position is not finite.

    Source: Tan, Zhou, Wang, Ceylan, Sun, Manocha, "A Repulsive Force Unit for Garment Collision Handling in Neural
        Networks", 2022. Differs: there a network that is trained with the garment's estimates a scale for each vertex;
        here one is given.
    """
    inside, depths, directions = _inside(vertices, distance)
    return _move(vertices, inside, directions, scale * depths[inside])


def _inside(
    vertices: Vertices, distance: Distance
) -> tuple[Mask, Float[np.ndarray, " verts"], Float[np.ndarray, "inside 3"]]:
    """Returns which vertices are inside, the absolute distances of all, and unit gradients at those inside."""
    if not np.isfinite(vertices).all():
        raise BadMesh("the garment's positions must be finite", "NaN or infinity", "look at what made them")
    signed = distance.signed_distances(vertices)
    inside = signed < 0
    gradients = distance.with_gradients(vertices[inside])[1]
    lengths = np.linalg.norm(gradients, axis=1, keepdims=True)
    return inside, np.abs(signed), gradients / np.maximum(lengths, 1e-12)


def _move(vertices: Vertices, inside: Mask, directions: np.ndarray, lengths: np.ndarray) -> MovedGarment:
    result = np.array(vertices)
    result[inside] += (directions * lengths[:, None]).astype(result.dtype)
    return MovedGarment(result, inside)
