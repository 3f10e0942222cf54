"""The kernel over pose and shape, compared with a dense regression, with refits, and with the blend of the paper."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from hemline.animators.agentdress.config import AgentDressConfig
from hemline.animators.agentdress.fit import shape_kernel
from hemline.animators.agentdress.fit.fit import fit
from hemline.animators.agentdress.fit.leave_one_out import leave_one_out_mm
from hemline.animators.agentdress.fit.shape_kernel import (
    SHAPE_RIDGES,
    SHAPE_WIDTHS,
    ShapeChanges,
    best_shape_kernel,
    fit_shape_kernel,
)
from hemline.animators.agentdress.pose_model import kernel
from hemline.animators.agentdress.shape_samples import (
    SHAPE_LENGTH_SCALE,
    SQUARE_WEIGHT,
    ShapeSamples,
    kernel_over_shapes,
)
from hemline.errors import BadInput, BadModel
from tests.animators import formula_garment as made

STILL = AgentDressConfig(decay_seconds=0.0)
WIDTH, RIDGE = 0.9, 0.2


@pytest.fixture(scope="module")
def problem():
    """Returns points in the plane in place of poses, with two regions, some bodies of two betas, and three outputs."""
    random = np.random.default_rng(0)
    points = random.normal(size=(9, 2))
    squares = (points[:, None] - points) ** 2
    distances = np.stack([squares.sum(axis=2), squares[:, :, 0]], axis=1)
    poses = np.sort(np.r_[random.integers(0, 9, 20), np.arange(9)])
    return distances, ShapeChanges(poses, random.normal(size=(29, 2)), random.normal(size=(29, 3)), poses)


def predict(fit, changes, distances, betas):
    """Returns the prediction of a fit for shapes in one pose, per region."""
    weights = kernel(distances[:, changes.poses], WIDTH)[:, None] * kernel_over_shapes(
        betas, changes.coordinates, SHAPE_LENGTH_SCALE
    )
    return np.einsum("gti,gik->gtk", weights, fit.weights)


def without(changes, pose):
    """Returns the bodies in other poses."""
    kept = changes.poses != pose
    return ShapeChanges(changes.poses[kept], changes.coordinates[kept], changes.outputs[kept], changes.groups[kept])


def conditional_covariance(one, other):
    """Returns the covariance of a Gaussian process conditioned on the mean shape, times the squared length scale."""

    def prior(a, b):
        return 1 / (1 + (cdist(a, b) / SHAPE_LENGTH_SCALE) ** 2)

    zero = np.zeros_like(one[:1])
    return SHAPE_LENGTH_SCALE**2 * (prior(one, other) - prior(one, zero) @ prior(zero, other) / prior(zero, zero))


def test_width_and_ridge_of_many_bodies_are_searched_with_some_and_all_are_fitted(problem, monkeypatch):
    distances, changes = problem
    some = changes.at_most(12)
    assert changes.at_most(29) is changes and 0 < len(some.poses) < 20
    for pose in np.unique(some.poses):  # whole groups, since a group is left out together
        assert (some.poses == pose).sum() == (changes.poses == pose).sum()
    monkeypatch.setattr(shape_kernel, "MOST_SEARCHED", 12)
    basis, regions = np.eye(3), np.full((1, 2), 0.5)
    best, _ = best_shape_kernel(distances, changes, basis, regions)
    pairs = [(width, ridge) for width in SHAPE_WIDTHS for ridge in SHAPE_RIDGES]
    errors = [
        leave_one_out_mm(fit_shape_kernel(distances, some, width=w, ridge=r).leave_one_out, basis, regions)
        for w, r in pairs
    ]
    assert (best.width, best.ridge) == pairs[int(np.argmin(errors))]
    whole = fit_shape_kernel(distances, changes, width=best.width, ridge=best.ridge, rounded=True)
    np.testing.assert_array_equal(best.weights, whole.weights)


def test_it_is_the_dense_kernel_ridge_regression(problem):
    distances, changes = problem
    found = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE)
    betas = np.array([[0.3, -1.1], [2.0, 0.4]])
    for region in range(2):
        between = np.array([[distances[p, region, q] for q in changes.poses] for p in changes.poses])
        gram = conditional_covariance(changes.coordinates, changes.coordinates) / (1 + between / WIDTH**2)
        solved = np.linalg.solve(gram + RIDGE * np.eye(29), changes.outputs)
        for pose in (0, 4):
            rows = conditional_covariance(betas, changes.coordinates) / (
                1 + distances[pose, region, changes.poses] / WIDTH**2
            )
            prediction = predict(found, changes, distances[pose], betas)[region]
            np.testing.assert_allclose(prediction, rows @ solved, atol=1e-10)


def test_the_mean_shape_has_no_effect_and_length_scale_zero_is_linear_and_square():
    random = np.random.default_rng(6)
    betas = random.normal(size=(5, 3))
    assert np.abs(kernel_over_shapes(betas, np.zeros((1, 3)), SHAPE_LENGTH_SCALE)).max() == 0
    features = np.concatenate([betas, SQUARE_WEIGHT * betas**2], axis=1)
    np.testing.assert_allclose(kernel_over_shapes(betas, betas, 0.0), features @ features.T, rtol=1e-12)


def test_samples_predict_like_the_fit(problem):
    """The bodies and weights of a file predict the same in single precision; betas are scaled for comparison."""
    distances, changes = problem
    found, scale = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE), np.array([[1.2, 0.3], [0.3, 0.5]])
    samples = ShapeSamples(
        changes.poses.astype(np.int32), changes.coordinates @ np.linalg.inv(scale), found.weights, scale
    )
    betas = np.array([[0.3, -1.1], [2.0, 0.4]])
    weights = kernel(distances[3, :, : samples.pose_count], WIDTH)
    stored = np.stack([np.einsum("gs,gsk->gk", weights, samples.effects(each)) for each in betas], axis=1)
    np.testing.assert_allclose(stored, predict(found, changes, distances[3], betas @ scale), atol=1e-5)


def test_leave_one_out_residuals_are_those_of_a_refit(problem):
    distances, changes = problem
    whole = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE)
    paired = fit_shape_kernel(distances, replace(changes, groups=changes.poses // 2), width=WIDTH, ridge=RIDGE)
    pair = np.isin(changes.poses, (2, 3))
    others = ShapeChanges(
        *(each[~pair] for each in (changes.poses, changes.coordinates, changes.outputs, changes.groups))
    )
    part = fit_shape_kernel(distances, others, width=WIDTH, ridge=RIDGE)
    for out in (2, 3):
        there = np.flatnonzero(changes.poses == out)
        prediction = predict(part, others, distances[out], changes.coordinates[there])
        np.testing.assert_allclose(changes.outputs[there] - prediction, paired.leave_one_out[:, there], atol=1e-10)
    for out in (0, 6):
        part = fit_shape_kernel(distances, without(changes, out), width=WIDTH, ridge=RIDGE)
        there = np.flatnonzero(changes.poses == out)
        assert len(there) > 1
        prediction = predict(part, without(changes, out), distances[out], changes.coordinates[there])
        np.testing.assert_allclose(changes.outputs[there] - prediction, whole.leave_one_out[:, there], atol=1e-10)


def test_width_and_ridge_have_the_least_leave_one_out_error(problem):
    distances, changes = problem
    random = np.random.default_rng(1)
    # the effect of the shape depends smoothly on the first coordinate, which both regions share
    slope = np.cos(distances[0, 1])[changes.poses, None] * changes.coordinates[:, :1]
    smooth = ShapeChanges(changes.poses, changes.coordinates, slope, changes.groups)
    basis = np.linalg.qr(random.normal(size=(12, 1)))[0].T
    regions = np.full((4, 2), 0.5)
    _, error_mm = best_shape_kernel(distances, smooth, basis, regions)
    assert error_mm > 0
    for width in SHAPE_WIDTHS:
        for ridge in SHAPE_RIDGES:
            other = fit_shape_kernel(distances, smooth, width=width, ridge=ridge)
            both = other.leave_one_out.mean(axis=0).reshape(-1)
            error = 1e3 * np.mean([np.linalg.norm(each * basis.reshape(4, 3), axis=1).mean() for each in both])
            assert error_mm <= error + 1e-9


def test_a_file_keeps_every_bit_of_weights_with_steps(problem):
    distances, changes = problem
    found = fit_shape_kernel(distances, changes, width=WIDTH, ridge=RIDGE, rounded=True)
    arrays = (changes.poses.astype(np.int32), changes.coordinates.astype(np.float32), found.weights.astype(np.float32))
    samples = ShapeSamples(*arrays, np.eye(2, dtype=np.float32))
    sizes, steps = (np.stack([getattr(each, name) for each in found.packed]) for name in ("sizes", "steps"))
    samples = replace(samples, sizes=sizes, steps=steps)
    stored = samples.arrays()
    assert stored["weights"].dtype == np.int8 and np.abs(stored["weights"]).max() <= 127
    read = ShapeSamples.of(stored, poses=9, regions=2)
    np.testing.assert_array_equal(read.weights, samples.weights)
    np.testing.assert_array_equal(read.betas, samples.betas)
    former = stored | {"betas": samples.betas}
    del former["bodies"]
    np.testing.assert_array_equal(ShapeSamples.of(former, poses=9, regions=2).betas, samples.betas)
    betas = np.float32([0.4, -1.2])
    np.testing.assert_array_equal(read.effects(betas), samples.effects(betas))
    half = replace(samples, sizes=None, steps=None).as_stored()
    np.testing.assert_array_equal(ShapeSamples.of(half.arrays(), poses=9, regions=2).weights, half.weights)


def test_samples_reproduce_given_effects():
    """The effects are multiples of betas and their squares at each pose, as in the shape models of the paper."""
    random = np.random.default_rng(2)
    effects = random.normal(size=(6, 2, 4, 5))
    samples = ShapeSamples.of_effects(effects)
    for betas in random.normal(size=(3, 3)):
        plain = np.einsum("f,fgsk->gsk", np.concatenate([betas, betas**2]), effects)
        np.testing.assert_allclose(samples.effects(betas), plain, rtol=1e-4, atol=1e-5)
    longer = np.array([0.4, -0.2, 1.0, 9.0, 9.0])
    np.testing.assert_array_equal(samples.effects(longer), samples.effects(longer[:3]))


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
        {"weights": np.zeros((2, 3, 4), np.int8)},
        {"bodies": np.int32([0, 1, 3])},
        {"bodies": np.int32([-1, 1, 2])},
        {"bodies": np.int32([0, 1])},
        {"weights": np.zeros((2, 3, 4), np.int8), "steps": np.ones((2, 4), np.float32)},
        {
            "weights": np.zeros((2, 3, 4), np.int8),
            "steps": np.ones((2, 3), np.float32),
            "sizes": np.ones((2, 3), np.float16),
        },
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


def test_it_errs_less_on_shapes_in_new_poses_than_five_blended_anchors(tmp_path):
    data, errors = made.make_dataset(tmp_path / "anchors", 24), {}
    for shape_model in ("kernel", "blended"):
        model = fit(data, replace(STILL, shape_model=shape_model))
        of_model = []
        for number in range(100, 110):
            pose = made.random_pose(number)
            for betas in ((1.5,), (-2.0, 1.0)):
                posed = made.body().body.shaped(np.asarray(betas, np.float32)).posed(pose)
                vertices = model.step(model.start(posed), posed, 1 / 30)[1]
                mean = made.body().posed(pose)
                still = model.step(model.start(mean), mean, 1 / 30)[1]
                # the error of the pose model cancels
                differences = vertices - still - made.lifted_garment(pose, betas) + made.lifted_garment(pose)
                of_model.append(np.linalg.norm(differences, axis=1).mean())
        errors[shape_model] = np.mean(of_model)
    assert errors["kernel"] < 0.9 * errors["blended"]


@pytest.mark.parametrize("shape_model", ["kernel", "blended"])
def test_a_file_keeps_both_shape_models(tmp_path, shape_model):
    from hemline import load

    model = fit(made.make_dataset(tmp_path / "anchors", 5), replace(STILL, shape_model=shape_model))
    assert len(model.tables.shapes.weights) == (1 if shape_model == "blended" else model.tables.regions.shape[1])
    model.save(tmp_path / "model.safetensors")
    again = load(tmp_path / "model.safetensors")
    posed = made.body().body.shaped(np.float32([1.0, -0.5])).posed(made.random_pose(3))
    ours, theirs = (each.step(each.start(posed), posed, 1 / 30)[1] for each in (model, again))
    np.testing.assert_array_equal(ours, theirs)


def test_an_unknown_shape_model_is_refused():
    with pytest.raises(BadInput, match="kernel, blended"):
        AgentDressConfig(shape_model="paper")
