"""The collision term: closed forms above a floor and around a ball, and the body of a real frame."""

import numpy as np
import pytest

from hemline import bodies
from hemline.collide.winding.numbers import inside
from hemline.learning.collision import TERM_DISTANCE, clearance, clearances, shortfall


def ball(radius=0.5):
    import trimesh

    mesh = trimesh.creation.icosphere(5, radius)
    return np.asarray(mesh.vertices), np.asarray(mesh.vertices) / radius


def test_heights_are_distances_to_the_skin():
    vertices, normals = ball()
    truth = np.array([[0.51, 0, 0], [0, 0.55, 0], [0, 0, -0.503]])
    found, heights = clearance(truth, vertices, normals)
    # the nearest vertex of a ball cut into 20480 triangles is at most 9 mm away: 9^2 / (2 * 500) = 0.08 mm
    assert heights == pytest.approx([0.01, 0.05, 0.003], abs=1e-4)
    assert np.einsum("vi,vi->v", found, truth / np.linalg.norm(truth, axis=1)[:, None]).min() > 0.999


def test_far_and_sunken_truth_asks_for_nothing():
    vertices, normals = ball()
    truth = np.array([[0.5 + TERM_DISTANCE + 0.01, 0, 0], [0.49, 0, 0]])
    found, heights = clearance(truth, vertices, normals)
    assert np.isinf(heights).all() and not found.any()
    assert not shortfall(np.full((2, 3), -1.0), found, heights, 0.006).any()


@pytest.mark.parametrize(
    ("offset", "lack"), [((0, 0, 0), 0.003), ((-0.01, 0, 0), 0.013), ((0.003, 0, 0), 0.0), ((0, 0.2, 0), 0.003)]
)
def test_what_is_missing_is_counted_along_the_normal(offset, lack):
    # the truth lies 3 mm above the skin, the normal along x: 6 mm are asked for
    found = shortfall(np.array([offset]), np.array([[1.0, 0, 0]]), np.array([0.003]), 0.006)
    assert found == pytest.approx([lack], abs=1e-12)


def test_arrays_and_tensors_say_the_same():
    torch = pytest.importorskip("torch", reason="learning needs torch (extra 'learn')")
    random = np.random.default_rng(0)
    offsets, normals = random.normal(size=(2, 50, 3)).astype(np.float32)
    heights = np.where(random.random(50) < 0.3, np.inf, random.random(50)).astype(np.float32)
    tensors = [torch.from_numpy(each).requires_grad_(each is offsets) for each in (offsets, normals, heights)]
    loss = (shortfall(*tensors, 0.006) ** 2).sum()
    loss.backward()
    assert float(loss.detach()) == pytest.approx(
        float((shortfall(offsets, normals, heights, 0.006) ** 2).sum()), rel=1e-5
    )
    # no term, no pull
    assert torch.isfinite(tensors[0].grad).all() and not tensors[0].grad[torch.from_numpy(np.isinf(heights))].any()


def test_near_the_skin_of_a_body_its_sign_is_that_of_the_winding_number():
    posed = bodies.load("anny24").shaped()
    posed = posed.posed(posed.rest_pose)
    random = np.random.default_rng(1)
    chosen = random.choice(len(posed.vertices), 3000, replace=False)
    truth = posed.vertices[chosen] + 0.004 * posed.normals[chosen]
    offsets = 0.005 * random.normal(size=(3000, 1)) * posed.normals[chosen]
    found = clearances(truth[None], [posed.vertices], [posed.normals])
    lacking = shortfall(offsets, *(each[0] for each in found.rows(np.array([0]), np.arange(3000))), 0.0) > 0
    truly = inside(posed.vertices, posed.faces, (truth + offsets).astype(np.float32))
    # they differ in creases, where another part of the skin is nearer than the plane knows
    assert (lacking == truly).mean() > 0.95
