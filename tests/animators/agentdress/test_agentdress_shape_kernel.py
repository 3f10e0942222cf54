"""What the shape adds in any pose, by a kernel over both: against a dense regression, refits, the paper's blend."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit.fit import fit
from hemline.animators.agentdress.fit.shape_kernel import (
    SHAPE_RIDGES,
    SHAPE_WIDTHS,
    ShapeChanges,
    best_shape_kernel,
    fit_shape_kernel,
)
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_samples import SHAPE_LENGTH_SCALE, SQUARE_WEIGHT, ShapeSamples, kernel_over_shapes
from hemline.errors import BadInput, BadModel
from tests.animators import dressed_by_formula as made

STILL = AgentDressConfig(decay_seconds=0.0)
WIDTH, RIDGE = 0.9, 0.2


@pytest.fixture(scope="module")
def problem():
    """Points in the plane in place of poses, seen by two regions; in each some bodies of two betas; three outputs."""
    random = np.random.default_rng(0)
    points = random.normal(size=(9, 2))
    apart = (points[:, None] - points) ** 2
    distances = np.stack([apart.sum(axis=2), apart[:, :, 0]], axis=1)
    poses = np.sort(np.r_[random.integers(0, 9, 20), np.arange(9)])
    return distances, ShapeChanges(poses, random.normal(size=(29, 2)), random.normal(size=(29, 3)), poses)


def told(found, changes, distances, betas):
    """What a fit says of shapes in one pose, by region."""
    shares = kernel(distances[:, changes.poses], WIDTH)[:, None] * kernel_over_shapes(betas, changes.where, SHAPE_LENGTH_SCALE)
    return np.einsum("gti,gik->gtk", shares, found.weights)


def without(changes, pose):
    """The bodies that are in other poses."""
    kept = changes.poses != pose
    return ShapeChanges(changes.poses[kept], changes.where[kept], changes.outputs[kept], changes.groups[kept])


def by_the_book(one, other):
    """The covariance of a Gaussian process at two shapes, once it is known at the mean one, times the reach squared."""

    def prior(a, b):
        return 1 / (1 + (cdist(a, b) / SHAPE_LENGTH_SCALE) ** 2)

    zero = np.zeros_like(one[:1])
    return SHAPE_LENGTH_SCALE**2 * (prior(one, other) - prior(one, zero) @ prior(zero, other) / prior(zero, zero))


def test_it_is_the_dense_kernel_ridge_regression(problem):
    distances, changes = problem
    found = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE)
    betas = np.array([[0.3, -1.1], [2.0, 0.4]])
    for region in range(2):
        between = np.array([[distances[p, region, q] for q in changes.poses] for p in changes.poses])
        gram = by_the_book(changes.where, changes.where) / (1 + between / WIDTH**2)
        solved = np.linalg.solve(gram + RIDGE * np.eye(29), changes.outputs)
        for pose in (0, 4):
            rows = by_the_book(betas, changes.where) / (1 + distances[pose, region, changes.poses] / WIDTH**2)
            said = told(found, changes, distances[pose], betas)[region]
            np.testing.assert_allclose(said, rows @ solved, atol=1e-10)


def test_the_mean_shape_adds_nothing_and_reach_zero_is_linear_and_square():
    random = np.random.default_rng(6)
    betas = random.normal(size=(5, 3))
    assert np.abs(kernel_over_shapes(betas, np.zeros((1, 3)), SHAPE_LENGTH_SCALE)).max() == 0
    features = np.concatenate([betas, SQUARE_WEIGHT * betas**2], axis=1)
    np.testing.assert_allclose(kernel_over_shapes(betas, betas, 0.0), features @ features.T, rtol=1e-12)


def test_a_model_keeps_what_the_fit_says(problem):
    """By the bodies and weights that a file holds, in single precision; betas are scaled where bodies are compared."""
    distances, changes = problem
    found, scale = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE), np.array([[1.2, 0.3], [0.3, 0.5]])
    samples = ShapeSamples(changes.poses.astype(np.int32), changes.where @ np.linalg.inv(scale), found.weights, scale)
    betas = np.array([[0.3, -1.1], [2.0, 0.4]])
    shares = kernel(distances[3, :, : samples.pose_count], WIDTH)
    kept = np.stack([np.einsum("gs,gsk->gk", shares, samples.effects(each)) for each in betas], axis=1)
    np.testing.assert_allclose(kept, told(found, changes, distances[3], betas @ scale), atol=1e-5)


def test_what_a_pose_would_miss_is_what_a_fit_without_it_misses(problem):
    distances, changes = problem
    whole = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE)
    paired = fit_shape_kernel(distances, replace(changes, together=changes.poses // 2), width=WIDTH, ridge=RIDGE)
    pair = np.isin(changes.poses, (2, 3))
    others = ShapeChanges(*(each[~pair] for each in (changes.poses, changes.where, changes.outputs, changes.groups)))
    part = fit_shape_kernel(distances, others, width=WIDTH, ridge=RIDGE)
    for out in (2, 3):
        there = np.flatnonzero(changes.poses == out)
        said = told(part, others, distances[out], changes.where[there])
        np.testing.assert_allclose(changes.outputs[there] - said, paired.leave_one_out[:, there], atol=1e-10)
    for out in (0, 6):
        part = fit_shape_kernel(distances, without(changes, out), width=WIDTH, ridge=RIDGE)
        there = np.flatnonzero(changes.poses == out)
        assert len(there) > 1
        said = told(part, without(changes, out), distances[out], changes.where[there])
        np.testing.assert_allclose(changes.outputs[there] - said, whole.leave_one_out[:, there], atol=1e-10)


def test_of_widths_and_ridges_the_best_in_poses_left_out_is_taken(problem):
    distances, changes = problem
    random = np.random.default_rng(1)
    # what a shape adds depends smoothly on the first coordinate, which both regions see
    slope = np.cos(distances[0, 1])[changes.poses, None] * changes.where[:, :1]
    smooth = ShapeChanges(changes.poses, changes.where, slope, changes.groups)
    basis = np.linalg.qr(random.normal(size=(12, 1)))[0].T
    regions = np.full((4, 2), 0.5)
    _, missed_mm = best_shape_kernel(distances, smooth, basis, regions)
    assert missed_mm > 0
    for width in SHAPE_WIDTHS:
        for ridge in SHAPE_RIDGES:
            other = fit_shape_kernel(distances, smooth, width=width, ridge=ridge)
            both = other.leave_one_out.mean(axis=0).reshape(-1)
            error = 1e3 * np.mean([np.linalg.norm(each * basis.reshape(4, 3), axis=1).mean() for each in both])
            assert missed_mm <= error + 1e-9


def test_given_effects_are_what_samples_add():
    """Multiples of betas and their squares at each pose, as the paper's shape models have them."""
    random = np.random.default_rng(2)
    effects = random.normal(size=(6, 2, 4, 5))
    samples = ShapeSamples.of_effects(effects)
    for betas in random.normal(size=(3, 3)):
        plain = np.einsum("f,fgsk->gsk", np.concatenate([betas, betas**2]), effects)
        np.testing.assert_allclose(samples.effects(betas), plain, rtol=1e-4, atol=1e-5)
    longer = np.array([0.4, -0.2, 1.0, 9.0, 9.0])
    np.testing.assert_array_equal(samples.effects(longer), samples.effects(longer[:3]))


def test_samples_of_poses_are_repeated_with_them():
    random = np.random.default_rng(3)
    samples = ShapeSamples(np.int32([0, 0, 2]), random.normal(size=(3, 2)), random.normal(size=(1, 3, 4)), np.eye(2))
    effects = samples.effects(np.array([0.5, -1.0]))
    again = samples.select_poses(np.array([2, 0, 2])).effects(np.array([0.5, -1.0]))
    np.testing.assert_allclose(again, effects[:, [2, 0, 2]], atol=1e-6)


@pytest.mark.parametrize(
    "broken",
    [
        {"poses": np.int32([0, 2, 1])},
        {"poses": np.int32([-1, 0, 1])},
        {"poses": np.int32([0, 1, 9])},
        {"poses": np.int32([]), "betas": np.zeros((0, 2), np.float32), "weights": np.zeros((1, 0, 4), np.float16)},
        {"weights": np.zeros((3, 3, 4), np.float16)},
        {"betas": np.zeros((2, 2), np.float32)},
        {"reach": np.float32([np.nan])},
        {"reach": np.float32([-1.0])},
        {"scale": np.eye(3, dtype=np.float32)},
        {"scale": np.full((2, 2), np.nan, np.float32)},
    ],
)
def test_samples_that_do_not_fit_the_model_are_refused(broken):
    whole = {
        "poses": np.int32([0, 1, 1]),
        "betas": np.zeros((3, 2), np.float32),
        "weights": np.zeros((2, 3, 4), np.float16),
        "reach": np.float32([10.0]),
        "scale": np.eye(2, dtype=np.float32),
    }
    assert ShapeSamples.of(whole, poses=3, regions=2).pose_count == 2
    with pytest.raises(BadModel):
        ShapeSamples.of(whole | broken, poses=3, regions=2)


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
    assert len(model.tables.shapes.weights) == (1 if way == "blended" else model.tables.regions.shape[1])
    model.save(tmp_path / "model.safetensors")
    again = load(tmp_path / "model.safetensors")
    posed = made.body().body.shaped(np.float32([1.0, -0.5])).posed(made.random_pose(3))
    ours, theirs = (each.step(each.start(posed), posed, 1 / 30)[1] for each in (model, again))
    np.testing.assert_array_equal(ours, theirs)


def test_a_way_that_does_not_exist_is_refused():
    with pytest.raises(BadInput, match="kernel, blended"):
        AgentDressConfig(shape_model="paper")
