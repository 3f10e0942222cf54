"""The clothing shape model of DRAPE, which AgentDress compares its own with."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.arrays import Faces, Float
from hemline.errors import BadMesh
from hemline.meshes import components, face_areas

Worn = Float[np.ndarray, "shapes verts 3"]
Gradients = Float[np.ndarray, "shapes faces 3 3"]


def frames(worn: Worn, faces: Faces) -> Gradients:
    r"""Columns: two edges of each triangle, and its normal as long as the root of twice its area [m].

    Args:
        worn: Garments [m].
        faces: Their triangles.
    """
    corners = worn[:, faces]
    first, second = corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    normal = np.cross(first, second)
    normal = normal / np.sqrt(np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-30))
    return np.stack([first, second, normal], axis=-1)


@dataclass(frozen=True, eq=False)
class Poisson:
    """The vertices that fit given deformation gradients best: the matrix is factorised once.

    Attributes:
        reference: The garment that the gradients deform [m].
        faces: Its triangles.
        roots: The roots of their areas [m].
    """

    reference: Float[np.ndarray, "verts 3"]
    faces: Faces
    roots: Float[np.ndarray, " faces"]
    _differences: Any
    _solve: Callable[[np.ndarray], np.ndarray]

    @classmethod
    def of(cls, reference: Float[np.ndarray, "verts 3"], faces: Faces) -> Self:
        """Factorise the least-squares problem of a garment [m].

        Raises:
            BadMesh: The garment is in several parts, which no gradient holds together.
        """
        from scipy.sparse import csr_matrix
        from scipy.sparse.linalg import splu

        parts = int(components(faces, len(reference)).max()) + 1
        if parts > 1:
            raise BadMesh("deformation gradients tell nothing of where parts lie", f"{parts} parts", "take one of them")
        roots = np.sqrt(face_areas(reference, faces))
        edges, weights = np.arange(2 * len(faces)), np.tile(roots, 2)
        shape = (2 * len(faces), len(reference))
        ends = csr_matrix((weights, (edges, faces[:, 1:].T.ravel())), shape)
        starts = csr_matrix((weights, (edges, np.tile(faces[:, 0], 2))), shape)
        free = (ends - starts)[:, 1:]  # the first vertex stays; the whole is moved to its place afterwards
        return cls(reference, faces, roots, free.T.tocsr(), splu((free.T @ free).tocsc()).solve)

    def gradients(self, worn: Worn) -> Gradients:
        """How each triangle of the reference is deformed; the third direction is that of the normal [1]."""
        return frames(worn, self.faces) @ np.linalg.inv(frames(self.reference[None], self.faces))

    def rows(self, worn: Worn, scales: Float[np.ndarray, " faces"]) -> Float[np.ndarray, "shapes entries"]:
        """The gradients of each garment in one row, those of each triangle scaled."""
        return (self.gradients(worn) * scales[:, None, None]).reshape(len(worn), -1)

    def vertices(self, gradients: Gradients, centres: Float[np.ndarray, "shapes 3"]) -> Worn:
        r"""$\arg\min_y \sum_t a_t \sum_k |y_{t,k} - y_{t,0} - F_t (x_{t,k} - x_{t,0})|^2$, by area [m].

        Args:
            gradients: $F$.
            centres: Mean of the vertices, which the gradients leave open [m].
        """
        edges = (gradients @ frames(self.reference[None], self.faces))[:, :, :, :2] * self.roots[:, None, None]
        right = edges.transpose(3, 1, 0, 2).reshape(2 * len(self.faces), -1)
        found = np.zeros((len(self.reference), right.shape[1]))
        found[1:] = self._solve(self._differences @ right)
        worn = found.reshape(len(found), -1, 3).transpose(1, 0, 2)
        return worn + (centres - worn.mean(axis=1))[:, None]


@dataclass(frozen=True, eq=False)
class DrapeShapeModel:
    """A garment on bodies of any shape, told by how its triangles are deformed.

    Attributes:
        poisson: From gradients back to vertices.
        gradients: Principal components of the gradients, and what the shape makes of them.
        scales: What the gradient of each triangle is multiplied by in them.
        centres: What the shape makes of the mean of the vertices.
    """

    poisson: Poisson
    gradients: ShapeModel
    scales: Float[np.ndarray, " faces"]
    centres: ShapeModel

    @classmethod
    def fit(
        cls,
        poisson: Poisson,
        worn: Worn,
        betas: Float[np.ndarray, "shapes betas"],
        *,
        components: int,
        ridge: float,
        squares: bool = False,
        by_area: bool = True,
    ) -> Self:
        """Components of the gradients, and a regression from the shape to their coefficients.

        Args:
            poisson: Of the garment on the mean shape.
            worn: The garment on each shape [m].
            betas: The shapes.
            components: Principal components.
            ridge: What the squares of the weights cost.
            squares: Whether squares of the betas count; DRAPE has none.
            by_area: Whether triangles count by their area, as they do when vertices are found again. Otherwise a
                triangle that is folded to nothing on the mean shape may be most of the variance.

        Source: Guan, Reiss, Hirshberg, Weiss, Black, "DRAPE: DRessing Any PErson", 2012, the shape model, as Wu et al.
            2021, section 4.3, compare with it. Differs: the third direction of a triangle, which its edges leave open,
            is its normal; where the garment lies is a regression of the mean of its vertices on the same features, as
            gradients do not tell it.
        """
        scales = poisson.roots if by_area else np.ones(len(poisson.faces))
        told = poisson.rows(worn, scales)
        return cls(
            poisson,
            ShapeModel.fit(told, betas, components=components, ridge=ridge, squares=squares),
            scales,
            ShapeModel.fit(worn.mean(axis=1), betas, components=3, ridge=ridge, squares=squares),
        )

    def at(
        self, betas: Float[np.ndarray, "shapes betas"], centres: Float[np.ndarray, "shapes 3"] | None = None
    ) -> Worn:
        """The garment on bodies of these shapes [m]; `centres`: where it is known to lie."""
        gradients = self.gradients.at(betas).reshape(len(betas), -1, 3, 3) / self.scales[:, None, None]
        return self.poisson.vertices(gradients, self.centres.at(betas) if centres is None else centres)
