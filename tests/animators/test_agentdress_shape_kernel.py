"""What the shape adds in any pose, by a kernel over both: against a dense regression, refits, the paper's blend."""

from dataclasses import replace

import dressed_by_formula as made
import numpy as np
import pytest

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit import fit
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_kernel import SQUARES, best_shape_kernel, fit_shape_kernel
from hemline.animators.agentdress.shape_model import shape_features
from hemline.errors import BadInput

STILL = AgentDressConfig(decay_seconds=0.0)
WIDTH, RIDGE = 0.9, 0.2


@pytest.fixture(scope="module")
def problem():
    """Points in the plane in place of poses, seen by two regions; five shapes of two betas; three outputs."""
    random = np.random.default_rng(0)
    points = random.normal(size=(9, 2))
    apart = (points[:, None] - points) ** 2
    distances = np.stack([apart.sum(axis=2), apart[:, :, 0]], axis=1)
    return distances, random.normal(size=(5, 2)), random.normal(size=(9, 5, 3))


def told(found, distances, betas):
    """What a fit says of shapes in one pose, by region."""
    weights = kernel(distances, WIDTH)
    return np.einsum("ga,tf,fgak->gtk", weights, shape_features(betas), found.effects)


def test_it_is_the_dense_kernel_ridge_regression(problem):
    distances, betas, changes = problem
    found = fit_shape_kernel(distances, betas, changes, width=WIDTH, ridge=RIDGE)
    weighed = shape_features(betas) * np.repeat([1.0, SQUARES], 2)
    query_betas = np.array([[0.3, -1.1], [2.0, 0.4]])
    query = shape_features(query_betas) * np.repeat([1.0, SQUARES], 2)
    for region in range(2):
        gram = np.kron(kernel(distances[:, region], WIDTH), weighed @ weighed.T)
        solved = np.linalg.solve(gram + RIDGE * np.eye(len(gram)), changes.reshape(len(gram), -1))
        for pose in (0, 4):
            rows = np.kron(kernel(distances[pose, region], WIDTH)[None], query @ weighed.T)
            said = told(found, distances[pose], query_betas)[region]
            np.testing.assert_allclose(said, rows @ solved, atol=1e-10)


def test_what_an_anchor_would_miss_is_what_a_fit_without_it_misses(problem):
    distances, betas, changes = problem
    whole = fit_shape_kernel(distances, betas, changes, width=WIDTH, ridge=RIDGE)
    for out in (0, 6):
        kept = np.arange(9) != out
        some = distances[kept][:, :, kept]
        part = fit_shape_kernel(some, betas, changes[kept], width=WIDTH, ridge=RIDGE)
        said = told(part, distances[out][:, kept], betas)
        np.testing.assert_allclose(changes[out] - said, whole.left_out[:, out], atol=1e-10)


def test_distances_that_no_space_has_blow_nothing_up():
    """Two poses at one place, and a third near the one and far from the other: a kernel with a negative eigenvalue."""
    apart = np.array([[0.0, 0.0, 9.0], [0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    assert np.linalg.eigvalsh(kernel(apart, WIDTH)).min() < -0.3
    betas = np.array([[1.0], [2.0]])
    changes = np.array([1.0, -1.0, 1.0])[:, None, None] * betas[None]
    for ridge in (0.01, 0.1, 1.0):
        found = fit_shape_kernel(apart[:, None], betas, changes, width=WIDTH, ridge=ridge)
        for pose in range(3):
            assert np.abs(told(found, apart[pose][None], betas)).max() < 3


def test_of_widths_and_ridges_the_best_at_anchors_left_out_is_taken(problem):
    distances, betas, _ = problem
    random = np.random.default_rng(1)
    # what a shape adds depends smoothly on the first coordinate, which both regions see
    slope = np.cos(distances[0, 1])[:, None, None] * betas[None, :, :1]
    basis = np.linalg.qr(random.normal(size=(12, 1)))[0].T
    regions = np.full((4, 2), 0.5)
    found, missed_mm = best_shape_kernel(distances, betas, slope, basis, regions)
    vertices = np.linalg.norm(found.left_out.mean(axis=0)[..., None] * basis.reshape(4, 3).T[None, None, 0], axis=-1)
    assert missed_mm > 0 and np.isfinite(vertices).all()
    for width in (0.7, 2.0):
        for ridge in (0.1, 3.0):
            other = fit_shape_kernel(distances, betas, slope, width=width, ridge=ridge)
            both = other.left_out.mean(axis=0).reshape(-1)
            directions = basis.reshape(4, 3)
            error = 1e3 * np.mean([np.linalg.norm(each * directions, axis=1).mean() for each in both])
            assert missed_mm <= error + 1e-9


def test_it_tells_more_of_shapes_in_new_poses_than_five_anchors_blended(tmp_path):
    data, errors = made.dataset(tmp_path / "anchors", 24), {}
    for way in ("kernel", "blended"):
        model = fit(data, replace(STILL, shape_model=way))
        missed = []
        for number in range(100, 110):
            pose = made.random_pose(number)
            for betas in ((1.5,), (-2.0, 1.0)):
                posed = made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose)
                worn = model.step(model.start(posed), posed, 1 / 30)[1]
                mean = made.body().posed(pose)
                still = model.step(model.start(mean), mean, 1 / 30)[1]
                # what the pose model misses is in both
                way_there = worn - still - made.settled(pose, betas) + made.settled(pose)
                missed.append(np.linalg.norm(way_there, axis=1).mean())
        errors[way] = np.mean(missed)
    assert errors["kernel"] < 0.9 * errors["blended"]


@pytest.mark.parametrize("way", ["kernel", "blended"])
def test_both_ways_are_kept_in_a_file(tmp_path, way):
    from hemline import load

    model = fit(made.dataset(tmp_path / "anchors", 5), replace(STILL, shape_model=way))
    assert model.tables.shape_effects.shape[1] == (1 if way == "blended" else model.tables.regions.shape[1])
    model.save(tmp_path / "model.safetensors")
    again = load(tmp_path / "model.safetensors")
    posed = made.body().body.shaped(np.float32([1.0, -0.5])).posed(made.random_pose(3))
    ours, theirs = (each.step(each.start(posed), posed, 1 / 30)[1] for each in (model, again))
    np.testing.assert_array_equal(ours, theirs)


def test_a_way_that_does_not_exist_is_refused():
    with pytest.raises(BadInput, match="kernel, blended"):
        AgentDressConfig(shape_model="paper")
