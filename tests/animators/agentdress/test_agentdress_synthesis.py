"""The equations of AgentDress in plain NumPy, and the system of the paper that they make."""

from functools import cache

import numpy as np
import pytest

from hemline.animators.agentdress.distances import anchor_weights
from hemline.animators.agentdress.sor.rigging import Rigging
from hemline.motions.quaternions import from_axis_angle, multiply
from papers.agentdress import synthesis
from papers.agentdress.models.paper_system import PaperSystem
from tests.animators.formula_garment import (
    anchor_pose,
    binding,
    body,
    formula,
    garment_in_pose,
    make_dataset,
    random_pose,
    rest_garment,
)

ANCHORS = 12


@pytest.fixture(scope="module")
def system(tmp_path_factory) -> PaperSystem:
    return PaperSystem.fit(make_dataset(tmp_path_factory.mktemp("drapes") / "data", ANCHORS, rigged=ANCHORS))


@cache
def random_arrays(*shape: int) -> np.ndarray:
    return np.random.default_rng(len(shape)).normal(size=shape)


def mean_mm(first: np.ndarray, second: np.ndarray) -> float:
    return 1e3 * float(np.linalg.norm(first - second, axis=1).mean())


def test_first_order_and_differences_agree_on_a_linear_garment_and_are_exact():
    by_shape, by_pose, origin = random_arrays(4, 9, 3), random_arrays(6, 9, 3)[:6], random_arrays(9, 3)

    def linear(betas, angles):
        return origin + np.tensordot(betas, by_shape, 1) + np.tensordot(angles, by_pose, 1)

    betas, angles = np.array([1.0, -0.5, 0.0, 2.0]), np.linspace(-1, 1, 6)
    truth, none = linear(betas, angles), np.zeros(4)
    first = synthesis.expand_to_first_order(origin, by_shape, by_pose, betas, angles)
    second = synthesis.expand_by_differences(linear(none, angles), linear(betas, np.zeros(6)), origin)
    np.testing.assert_allclose(first, truth, atol=1e-12)
    np.testing.assert_allclose(second, truth, atol=1e-12)


def test_skin_bound_to_itself_follows_the_body():
    shaped = body().body.shaped((1.0, -1.0))
    first, second = shaped.posed(random_pose(1)), shaped.posed(random_pose(2))
    resting = shaped.posed(shaped.rest_pose)
    closest = synthesis.bind_to_skin(resting.vertices, resting)
    weights = synthesis.bone_weights(shaped, closest)
    moved = synthesis.skin_from_pose(resting.vertices, weights, resting.transforms, second.transforms)
    assert np.abs(moved - second.vertices).max() < 1e-5
    one_bone = weights.max(axis=1) == 1
    there = synthesis.skin_from_pose(first.vertices, weights, first.transforms, second.transforms)
    assert one_bone.mean() > 0.05 and np.abs(there - second.vertices)[one_bone].max() < 1e-5
    assert np.abs(there - second.vertices).max() > 1e-3  # Eq. 3 starts from a garment that skinning has bent already


def test_joint_angles_are_those_that_a_joint_was_turned_by():
    pose = random_pose(3).rotations.astype(np.float64)
    angles = 0.4 * random_arrays(*pose.shape[:1], 3)
    turned = multiply(pose, from_axis_angle(angles))
    np.testing.assert_allclose(synthesis.joint_angles(turned, pose), angles, atol=1e-6)


def test_blend_weights_are_inverse_cubes_of_the_five_nearest_and_equal_the_kernel():
    distances = random_arrays(3, 8) ** 2 + 0.1
    scale = np.median(distances, axis=1)
    weights = synthesis.blend_weights(distances, scale)
    assert ((weights > 0).sum(axis=1) == synthesis.NEIGHBOURS).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    near = np.argsort(distances[0])[:2]
    ratio = (distances[0, near[1]] / distances[0, near[0]]) ** 3
    assert weights[0, near[0]] / weights[0, near[1]] == pytest.approx(ratio, rel=1e-4)
    options = {"neighbours": synthesis.NEIGHBOURS, "power": synthesis.POWER, "floor": synthesis.SMALL}
    np.testing.assert_allclose(weights, anchor_weights(distances / scale[:, None], **options), rtol=1e-9)
    at_one = distances.copy()
    at_one[:, 2] = 0
    np.testing.assert_allclose(synthesis.blend_weights(at_one, scale)[:, 2], 1, atol=1e-9)


def test_distances_count_joints_by_the_square_of_how_far_they_move_the_region(system):
    regions = system.regions_on(body())
    np.testing.assert_allclose(regions.sum(axis=1), 1, atol=1e-6)
    influence = synthesis.joint_influence(regions, system.sensitivity)
    angles = np.zeros((1, *system.sensitivity.shape[1:]))
    angles[0, 16, 2] = 0.3
    expected = 0.09 * (regions * system.sensitivity[:, 16, 2, None] ** 2).sum(axis=0)
    np.testing.assert_allclose(synthesis.pose_distances(influence, angles)[:, 0], expected, rtol=1e-6)
    left, right = expected[1], expected[2]
    assert left > 1e3 * right  # the left shoulder does not move the right sleeve


def test_decay_leads_from_the_distances_of_the_frame_before_to_those_of_this_one():
    now, before = random_arrays(2, 5) ** 2, np.ones((2, 5))
    np.testing.assert_array_equal(synthesis.decay_distances(now, before, 0.0), now)
    np.testing.assert_allclose(synthesis.decay_distances(now, before, 0.25), 0.25 + 0.75 * now)


def test_clearances_are_restored_up_to_the_margin_and_nothing_else_moves():
    posed = body().posed(random_pose(4))
    chosen = np.arange(0, len(posed.vertices), 400)
    skin, normals = posed.vertices[chosen].astype(np.float64), posed.normals[chosen]
    heights = np.linspace(-0.002, 0.012, len(chosen))
    garment = skin + heights[:, None] * normals
    own = synthesis.clearances(garment, posed)
    initial = np.array([np.full(len(chosen), 0.004), np.full(len(chosen), 0.02)])
    weights = np.tile([0.25, 0.75], (len(chosen), 1))
    moved = synthesis.restore_clearances(garment, initial, weights, posed)
    push = 0.25 * np.maximum(0.004 - own, 0) + 0.75 * np.maximum(synthesis.MARGIN - own, 0)
    np.testing.assert_allclose(np.linalg.norm(moved - garment, axis=1), push, atol=1e-7)
    np.testing.assert_array_equal(moved[own > synthesis.MARGIN], garment[own > synthesis.MARGIN])
    out = synthesis.push_out_of_body(garment, posed)
    assert synthesis.clearances(out, posed).min() > -1e-4 and (own < 0).any()
    np.testing.assert_array_equal(out[own >= 0], garment[own >= 0])


def test_at_an_anchor_on_the_mean_body_the_paper_returns_the_settled_garment(system):
    for number in range(3):
        pose = anchor_pose(random_pose(number))
        assert mean_mm(system.expand(body().posed(pose))[0], garment_in_pose(pose)) < 0.01


def test_on_new_bodies_in_new_poses_the_first_order_module_pays(system):
    shaped = body().body.shaped((1.5, -1.0))
    errors = []
    for number in range(40, 44):
        pose = anchor_pose(random_pose(number))
        truth, posed = garment_in_pose(pose, (1.5, -1.0)), shaped.posed(pose)
        mean = garment_in_pose(pose).astype(np.float64)
        garments = system.expand(posed, mean)[0], system.expand(posed)[0], system.without_first_order(posed)
        errors.append([mean_mm(each, truth) for each in garments])
    given, rigged, without = np.mean(errors, axis=0)
    assert given < rigged < 0.6 * without


def test_rigging_and_the_plain_equations_skin_alike(system):
    pose = anchor_pose(random_pose(50))
    weights = system.weights(pose, system.regions_on(body()))
    plain, rigging = np.zeros_like(rest_garment()), system.rigging
    transforms = body().posed(pose).transforms
    for anchor in range(ANCHORS):
        own = rigging.vertices[anchor], rigging.weights[anchor], rigging.transforms[anchor]
        plain += weights[:, [anchor]] * synthesis.skin_from_pose(*own, transforms)
    assert isinstance(rigging, Rigging)
    np.testing.assert_allclose(system.pose_model(pose, weights), plain, atol=1e-6)
    np.testing.assert_allclose(rigging.at(transforms, weights), plain, atol=1e-6)


def test_fewer_anchors_err_more(system):
    few = system.subset(np.arange(2))
    poses = [anchor_pose(random_pose(number)) for number in range(40, 46)]
    errors = [
        [mean_mm(each.expand(body().posed(pose))[0], garment_in_pose(pose)) for pose in poses] for each in (few, system)
    ]
    assert np.mean(errors[1]) < np.mean(errors[0])
    assert len(few.rotations) == 2 and binding().nearest.shape == formula(poses[0], ()).shape[:1]
