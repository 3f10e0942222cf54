"""The DRAPE baseline: gradients and vertices are inverse to each other, and no frame is preferred."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.errors import BadMesh
from papers.agentdress.models.drape_baseline import DrapeShapeModel, Poisson

TURN, SHIFT = Rotation.from_rotvec([0.4, -1.1, 0.3]).as_matrix(), np.array([0.3, -0.2, 0.5])


def sheet() -> tuple[np.ndarray, np.ndarray]:
    """Returns a curved sheet of 9 by 7 vertices."""
    u, v = (each.ravel() for each in np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 7), indexing="ij"))
    first = (7 * np.arange(8)[:, None] + np.arange(6)).ravel()
    faces = np.concatenate([np.stack([first, first + 7, first + 1], 1), np.stack([first + 7, first + 8, first + 1], 1)])
    return np.stack([np.cos(2 * u), v, np.sin(2 * u)], axis=1), faces.astype(np.int32)


def make_garments() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns garments of different width, length and noise, with faces and betas."""
    mean, faces = sheet()
    random = np.random.default_rng(3)
    betas = np.concatenate([np.zeros((1, 2)), random.normal(size=(6, 2))])
    sizes = np.stack([1 + 0.2 * betas[:, 0], 1 + 0.1 * betas[:, 1] ** 2, 1 + 0.2 * betas[:, 0]], axis=1)
    noise = 0.01 * random.normal(size=(7, *mean.shape))
    noise[0] = 0
    return mean * sizes[:, None] + noise, faces, betas


def model(garments: np.ndarray, faces: np.ndarray, betas: np.ndarray, components: int = 6) -> DrapeShapeModel:
    poisson = Poisson.of(garments[0], faces)
    return DrapeShapeModel.fit(poisson, garments, betas, components=components, ridge=0.2, squares=True)


def test_gradients_of_a_garment_lead_back_to_it():
    garments, faces, _ = make_garments()
    poisson = Poisson.of(garments[0], faces)
    found = poisson.vertices(poisson.gradients(garments), garments.mean(axis=1))
    np.testing.assert_allclose(found, garments, atol=1e-12)


@pytest.mark.parametrize("by_area", [True, False])
def test_with_all_components_and_free_weights_fitted_garments_come_back(by_area):
    """With one feature less than garments, the regression interpolates all garments."""
    garments, faces, betas = make_garments()
    garments, betas = garments[:5], betas[:5]
    poisson = Poisson.of(garments[0], faces)
    options = {"ridge": 1e-12, "squares": True, "by_area": by_area}
    found = DrapeShapeModel.fit(poisson, garments, betas, components=4, **options)
    np.testing.assert_allclose(found.at(betas), garments, atol=1e-7)
    fewer = DrapeShapeModel.fit(poisson, garments, betas, components=1, **options)
    assert np.abs(fewer.at(betas) - garments).max() > 1e-3


def test_gradients_of_a_linear_map_are_that_map_within_the_triangles():
    mean, faces = sheet()
    stretch = np.diag([1.3, 0.8, 1.1])
    gradients = Poisson.of(mean, faces).gradients((mean @ stretch.T)[None])[0]
    edge = mean[faces[:, 2]] - mean[faces[:, 0]]
    np.testing.assert_allclose(np.einsum("fij,fj->fi", gradients, edge), edge @ stretch.T, atol=1e-12)
    np.testing.assert_allclose(
        Poisson.of(mean, faces).gradients((mean @ TURN.T + SHIFT)[None])[0], [TURN] * len(faces), atol=1e-9
    )


def test_rigidly_moved_garments_are_predicted_with_the_same_motion():
    garments, faces, betas = make_garments()
    wanted_gradients = np.array([[0.5, -0.3], [-1.0, 2.0]])
    found = model(garments, faces, betas, 3).at(wanted_gradients)
    moved = model(garments @ TURN.T + SHIFT, faces, betas, 3).at(wanted_gradients)
    np.testing.assert_allclose(moved, found @ TURN.T + SHIFT, atol=1e-9)


def test_no_other_vertices_fit_gradients_of_no_garment_better():
    """Neighbours of the minimum have larger sums of squares."""
    mean, faces = sheet()
    poisson, random = Poisson.of(mean, faces), np.random.default_rng(5)
    wanted_gradients = np.eye(3) + 0.3 * random.normal(size=(1, len(faces), 3, 3))
    found = poisson.vertices(wanted_gradients, np.zeros((1, 3)))[0]
    area = 0.5 * np.linalg.norm(
        np.cross(mean[faces[:, 1]] - mean[faces[:, 0]], mean[faces[:, 2]] - mean[faces[:, 0]]), axis=1
    )

    def squared_error(vertices: np.ndarray) -> float:
        total = 0.0
        for corner in (1, 2):
            wanted = np.einsum("fij,fj->fi", wanted_gradients[0], mean[faces[:, corner]] - mean[faces[:, 0]])
            total += area @ ((vertices[faces[:, corner]] - vertices[faces[:, 0]] - wanted) ** 2).sum(axis=1)
        return float(total)

    for _ in range(20):
        assert squared_error(found) < squared_error(found + 1e-4 * random.normal(size=found.shape))


def test_a_garment_in_two_parts_is_refused():
    mean, faces = sheet()
    with pytest.raises(BadMesh, match="2 parts"):
        Poisson.of(np.concatenate([mean, mean + 2]), np.concatenate([faces, faces + len(mean)]))
