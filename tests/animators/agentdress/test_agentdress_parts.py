"""Laws of regions, binding, distances, weights and regressions of AgentDress, without a fit."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline.animators.agentdress.distance_kernels import mix
from hemline.animators.agentdress.distances import anchor_weights, axes_between, axis_weights, region_distances
from hemline.animators.agentdress.fit.regions import region_weights
from hemline.animators.agentdress.pose_model import fit_kernel, kernel
from hemline.animators.agentdress.shape_model import ShapeModel
from hemline.motions.quaternions import from_axis_angle, multiply
from tests.animators import formula_garment as made


def test_regions_share_each_vertex():
    regions = region_weights(made.binding())
    np.testing.assert_allclose(regions.sum(axis=1), 1, atol=1e-6)
    assert 5 <= regions.shape[1] <= 10 and (regions.mean(axis=0) >= 0.01).all()


def test_offsets_invert_skinning():
    pose = made.random_pose(55)
    transforms, offsets = made.body().posed(pose).transforms, made.formula(pose, ())
    there = made.binding().skin(transforms, made.rest_garment(), offsets)
    np.testing.assert_allclose(made.binding().offsets(transforms, made.rest_garment(), there), offsets, atol=1e-9)


def test_fit_rest_is_the_least_squares_solution():
    """Skinned garments are recovered; with offsets added, no other garment is closer."""
    poses = [made.random_pose(number) for number in range(5)]
    transforms = np.array([made.body().posed(pose).transforms for pose in poses], np.float64)
    binding, random = made.binding(), np.random.default_rng(0)
    plain = np.array([binding.skin(each, made.rest_garment()) for each in transforms])
    np.testing.assert_allclose(binding.fit_rest(transforms, plain), made.rest_garment(), atol=1e-9)
    added = plain + random.normal(scale=0.01, size=plain.shape)
    found = binding.fit_rest(transforms, added)

    def missed(rest):
        return sum(
            ((binding.skin(each, rest) - there) ** 2).sum() for each, there in zip(transforms, added, strict=True)
        )

    for _ in range(3):
        way = random.normal(scale=1e-3, size=found.shape)
        assert missed(found) < missed(found + way) and missed(found) < missed(found - way)


def test_vertex_frames_rotate_with_their_bones():
    """With an arm rotated by 150 degrees, the blended transform shrinks, but vertex frames stay rotations."""
    pose = made.turn_joints((made.SHOULDER, (0.0, 0.0, -2.6)))
    transforms, binding = made.body().posed(pose).transforms, made.binding()
    found = binding.rotations(transforms)
    np.testing.assert_allclose(
        np.einsum("vij,vkj->vik", found, found), np.tile(np.eye(3), (len(found), 1, 1)), atol=1e-9
    )
    shrunk = np.linalg.svd(binding.matrices(transforms)[:, :, :3], compute_uv=False)[:, 2]
    assert shrunk.min() < 0.6
    # where bones differ little, the mean rotation of another library
    bent = (
        made.body().posed(made.turn_joints((made.SHOULDER, (0.0, 0.3, -0.5)), (made.SPINE, (0.2, 0.0, 0.0)))).transforms
    )
    found = binding.rotations(bent)
    for vertex in range(0, len(found), 40):
        bones = Rotation.from_matrix(bent[binding.indices[vertex], :, :3].astype(np.float64))
        mean = bones.mean(np.maximum(binding.weights[vertex], 1e-9))
        np.testing.assert_allclose(found[vertex], mean.as_matrix(), atol=5e-3)


def test_the_shape_model_is_a_ridge_regression_with_a_free_constant():
    """Least squares with rows for the ridge give the same model."""
    random = np.random.default_rng(0)
    betas, garments = random.normal(size=(17, 4)), random.normal(size=(17, 60))
    model = ShapeModel.fit(garments, betas, components=5, ridge=0.2)
    left, sizes, right = np.linalg.svd(garments - garments.mean(axis=0), full_matrices=False)
    features = np.hstack([betas, betas**2, np.ones((17, 1))])
    penalty = np.sqrt(0.2) * np.eye(9)
    penalty[8] = 0
    weights = np.linalg.lstsq(
        np.vstack([features, penalty]), np.vstack([left[:, :5] * sizes[:5], np.zeros((9, 5))]), rcond=None
    )[0]
    at = random.normal(size=(3, 4))
    wanted = garments.mean(axis=0) + np.hstack([at, at**2, np.ones((3, 1))]) @ weights @ right[:5]
    np.testing.assert_allclose(model.at(at), wanted, atol=1e-10)
    assert model.explained == pytest.approx((sizes[:5] ** 2).sum() / (sizes**2).sum())
    plain = ShapeModel.fit(garments, betas, components=5, ridge=0.2, squares=False)
    np.testing.assert_allclose(plain.at(at) + plain.at(-at), 2 * plain.at(0 * at), atol=1e-10)


def test_leave_one_out_residuals_are_those_of_a_refit():
    random = np.random.default_rng(1)
    points, outputs = random.normal(size=(12, 3)), random.normal(size=(12, 4))
    distances = ((points[:, None] - points) ** 2).sum(axis=2)[:, None]
    alone, pairs = np.arange(12), np.arange(12) // 2
    for together, out in ((alone, 0), (alone, 5), (pairs, 0), (pairs, 5)):
        whole = fit_kernel(distances, outputs, together, width=1.3, ridge=1e-2)
        kept = together != together[out]
        part = fit_kernel(distances[np.ix_(kept, [0], kept)], outputs[kept], together[kept], width=1.3, ridge=1e-2)
        told = kernel(distances[out, 0, kept], 1.3) @ part.weights[0]
        np.testing.assert_allclose(outputs[out] - told, whole.leave_one_out[0, out], atol=1e-9)


def test_blend_weights_are_those_of_the_paper():
    distances = np.array([[0.5, 0.1, 2.0, 0.3]])
    weights = anchor_weights(distances, neighbours=3, power=3.0, floor=0.02)
    plain = np.array([1 / (d + 0.02) ** 3 if d < 1 else 0.0 for d in distances[0]])
    np.testing.assert_allclose(weights[0], plain / plain.sum(), rtol=1e-12)
    assert anchor_weights(np.zeros((1, 2)), neighbours=5, power=3.0, floor=0.02).tolist() == [[0.5, 0.5]]
    tiny = anchor_weights(np.array([[1e-30, 1.0]]), neighbours=2, power=200.0, floor=1e-12)
    assert np.isfinite(tiny).all() and tiny[0, 0] == pytest.approx(1)


def test_distances_are_sums_over_the_axes_of_the_joints():
    random = np.random.default_rng(2)
    rotations = from_axis_angle(random.normal(size=(2, 24, 3)) * 0.5)
    weights = random.uniform(size=(3, 72))
    found = region_distances(axes_between(rotations[:1], rotations[1:]), weights)[0, :, 0]
    here, there = (Rotation.from_quat(each[:, [1, 2, 3, 0]]) for each in rotations)
    moved = np.stack([here.apply(axis) - there.apply(axis) for axis in np.eye(3)], axis=1)
    np.testing.assert_allclose(found, weights @ (moved**2).sum(axis=2).ravel(), rtol=1e-9)


def test_a_small_rotation_counts_as_much_as_it_moves_the_cloth():
    """A rotation about one axis counts its influence times the squared angle, in any pose and modulo full turns."""
    random = np.random.default_rng(4)
    influence = random.uniform(0.5, 1.0, size=(2, 24, 3))
    pose = from_axis_angle(random.normal(size=(24, 3)))
    for joint, axis in ((3, 0), (7, 1), (20, 2)):
        near = pose.copy()
        near[joint] = multiply(pose[joint], from_axis_angle(1e-3 * np.eye(3)[axis]))
        found = region_distances(axes_between(near[None], pose[None]), axis_weights(influence))[0, :, 0]
        np.testing.assert_allclose(found, 1e-6 * influence[:, joint, axis], rtol=1e-5)
        beyond = near.copy()
        beyond[joint] = -near[joint]
        again = region_distances(axes_between(beyond[None], pose[None]), axis_weights(influence))[0, :, 0]
        np.testing.assert_allclose(again, found, rtol=1e-9)


def test_axis_weights_are_not_negative():
    weights = axis_weights(np.array([[[5.0, 1.0, 2.0]]]))
    np.testing.assert_allclose(weights, [[0.0, 3.0, 2.0]])


def test_every_kernel_of_the_distances_can_be_inverted():
    """Kernel matrices of any poses have no negative eigenvalue."""
    random = np.random.default_rng(5)
    rotations = from_axis_angle(random.normal(size=(40, 24, 3)) * 1.5)
    distances = region_distances(axes_between(rotations, rotations), axis_weights(random.uniform(size=(2, 24, 3))))
    for width in (0.5, 2.0, 20.0):
        for region in range(2):
            assert np.linalg.eigvalsh(kernel(distances[:, region], width)).min() > -1e-9


@pytest.mark.parametrize("poses, anchors", [(0, 3), (1, 8), (11, 6), (16, 1)])
def test_mix_equals_plain_numpy(poses, anchors):
    """It holds for any number of rows, with kernel values of 0 and large weights of both signs."""
    random = np.random.default_rng(5)
    shares, others = random.normal(size=(2, poses)), random.normal(size=(2, anchors))
    others[:, 1:5] = 0
    weights = (1e4 * random.normal(size=(2, poses, 5))).astype(np.float32)
    effects = random.normal(size=(1, anchors, 3)).astype(np.float32)
    modes, scales = np.array([0, 7, 3, 4, 4, 5, 6], np.int32), random.uniform(size=7).astype(np.float32)
    mixed = np.empty((2, 7), np.float32)
    mix(shares, weights, others, effects, modes, scales, mixed)
    told = [
        np.concatenate([shares[g] @ weights[g].astype(float), others[g] @ effects[0].astype(float)]) for g in (0, 1)
    ]
    np.testing.assert_allclose(mixed, np.array(told)[:, modes] * scales, rtol=1e-5, atol=1e-6)
