"""The clothing shape model of DRAPE, a baseline of the paper."""

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
    r"""Returns a frame of each triangle: two edges, and the normal scaled to the root of twice the area, as columns
    [m].

    Args:
        worn: Garments [m].
        faces: Triangles of the garments.
    """
    corners = worn[:, faces]
    first, second = corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2] - corners[:, :, 0]
    normal = np.cross(first, second)
    normal = normal / np.sqrt(np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-30))
    return np.stack([first, second, normal], axis=-1)


@dataclass(frozen=True, eq=False)
class Poisson:
    """Least-squares solver for vertices from deformation gradients, factorised once.

    Attributes:
        reference: The garment that the gradients deform [m].
        faces: Triangles of the garment.
        roots: Square roots of the triangle areas [m].
    """

    reference: Float[np.ndarray, "verts 3"]
    faces: Faces
    roots: Float[np.ndarray, " faces"]
    _differences: Any
    _solve: Callable[[np.ndarray], np.ndarray]

    @classmethod
    def of(cls, reference: Float[np.ndarray, "verts 3"], faces: Faces) -> Self:
        """Factorises the least-squares problem of a garment [m].

        Raises:
            BadMesh: The garment has several parts, whose relative position gradients do not determine.
        """
        from scipy.sparse import csr_matrix
        from scipy.sparse.linalg import splu

        parts = int(components(faces, len(reference)).max()) + 1
        if parts > 1:
            raise BadMesh("deformation gradients do not place separate parts", f"{parts} parts", "take one of them")
        roots = np.sqrt(face_areas(reference, faces))
        edges, weights = np.arange(2 * len(faces)), np.tile(roots, 2)
        shape = (2 * len(faces), len(reference))
        ends = csr_matrix((weights, (edges, faces[:, 1:].T.ravel())), shape)
        starts = csr_matrix((weights, (edges, np.tile(faces[:, 0], 2))), shape)
        free = (ends - starts)[:, 1:]  # the first vertex is fixed; the garment is moved to its place afterwards
        return cls(reference, faces, roots, free.T.tocsr(), splu((free.T @ free).tocsc()).solve)

    def gradients(self, worn: Worn) -> Gradients:
        """Returns the deformation gradient of each triangle; the third direction is the normal [1]."""
        return frames(worn, self.faces) @ np.linalg.inv(frames(self.reference[None], self.faces))

    def rows(self, worn: Worn, scales: Float[np.ndarray, " faces"]) -> Float[np.ndarray, "shapes entries"]:
        """Returns the scaled gradients of each garment in one row."""
        return (self.gradients(worn) * scales[:, None, None]).reshape(len(worn), -1)

    def vertices(self, gradients: Gradients, centres: Float[np.ndarray, "shapes 3"]) -> Worn:
        r"""Returns $\arg\min_y \sum_t a_t \sum_k |y_{t,k} - y_{t,0} - F_t (x_{t,k} - x_{t,0})|^2$, by area [m].

        Args:
            gradients: $F$.
            centres: Mean of the vertices, which the gradients do not determine [m].
        """
        edges = (gradients @ frames(self.reference[None], self.faces))[:, :, :, :2] * self.roots[:, None, None]
        right = edges.transpose(3, 1, 0, 2).reshape(2 * len(self.faces), -1)
        solution = np.zeros((len(self.reference), right.shape[1]))
        solution[1:] = self._solve(self._differences @ right)
        worn = solution.reshape(len(solution), -1, 3).transpose(1, 0, 2)
        return worn + (centres - worn.mean(axis=1))[:, None]


@dataclass(frozen=True, eq=False)
class DrapeShapeModel:
    """A shape model on the deformation gradients of a garment.

    Attributes:
        poisson: Solver from gradients to vertices.
        gradients: Shape model of the scaled gradients.
        scales: Scale of the gradient of each triangle.
        centres: Shape model of the mean of the vertices.
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
        """Fits principal components of the gradients, and a regression from the shape to their coefficients.

        Args:
            poisson: Solver of the garment on the mean shape.
            worn: The garment on each shape [m].
            betas: Betas of each shape.
            components: Number of principal components.
            ridge: Penalty on the squared weights.
            squares: Whether squared betas are features too; DRAPE has none.
            by_area: Whether triangles count by their area, as in the solver. Otherwise a triangle that is degenerate on
                the mean shape may dominate the variance.

        Source: Guan, Reiss, Hirshberg, Weiss, Black, "DRAPE: DRessing Any PErson", 2012, its shape model, with
            which section 4.3 of the AgentDress paper compares. Differs: the third direction of a triangle, which its
            edges do not determine, is its normal. The place of the garment, which gradients do not determine, is a
            regression of the mean of its vertices on the same features.
        """
        scales = poisson.roots if by_area else np.ones(len(poisson.faces))
        rows = poisson.rows(worn, scales)
        return cls(
            poisson,
            ShapeModel.fit(rows, betas, components=components, ridge=ridge, squares=squares),
            scales,
            ShapeModel.fit(worn.mean(axis=1), betas, components=3, ridge=ridge, squares=squares),
        )

    def at(
        self, betas: Float[np.ndarray, "shapes betas"], centres: Float[np.ndarray, "shapes 3"] | None = None
    ) -> Worn:
        """Returns the garment on bodies of these shapes [m]; `centres`, if given, are the means of its vertices [m]."""
        gradients = self.gradients.at(betas).reshape(len(betas), -1, 3, 3) / self.scales[:, None, None]
        return self.poisson.vertices(gradients, self.centres.at(betas) if centres is None else centres)
