"""Features of vertices: the same wherever the body stands, in a mirror, and by formula."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from hemline import bodies, garments, motions
from hemline.animators.coarse.features.columns import DYNAMIC, STATIC
from hemline.animators.coarse.features.trail import Trail
from hemline.animators.coarse.proxy_on_body import Cells, ProxyOnBody
from hemline.animators.soft_weights import BLUR_FRACTION, MIN_BLUR, soft_weights
from hemline.animators.swingar.graph_inputs import VERTEX, vertex_inputs
from hemline.garments import coarser_garment
from hemline.learning.mirror import mirror_motion
from hemline.motions.motion import Pose
from hemline.motions.quaternions import from_axis_angle, multiply, rotate, to_matrix


@cache
def body():
    return bodies.load("anny24").shaped()


@cache
def proxy():
    skirt, _ = coarser_garment(garments.load("skirt-light"), 0.1)
    return ProxyOnBody.of(skirt, skirt.vertices, body())


@cache
def clip():
    return body().placed(motions.load("kick"))[60:90]


def features_of(made, motion):
    trail = Trail.start(made, made.shaped.posed(motion[0]))
    for frame in range(1, len(motion)):
        trail = trail.advance(made, made.shaped.posed(motion[frame]), 1 / motion.fps)
    return trail, trail.features(made, made.shaped.posed(motion[len(motion) - 1]))


def test_a_body_that_was_always_at_rest_tells_only_what_is_near():
    posed = body().posed(body().rest_pose)
    trail = Trail.start(proxy(), posed)
    np.testing.assert_allclose(trail.skinned, proxy().rest, atol=1e-5)
    np.testing.assert_allclose(trail.turns, np.tile([1, 0, 0, 0], (len(trail.turns), 1)), atol=1e-6)
    found = trail.features(proxy(), posed)
    assert found.shape == (len(proxy().rest), DYNAMIC.count)
    gravity = found[:, DYNAMIC["gravity"]]
    np.testing.assert_allclose(found[:, : DYNAMIC["gravity"].start], 0, atol=1e-6)
    np.testing.assert_allclose(gravity, np.tile([0, -0.5 / np.sqrt(2), 0], (len(gravity), 1)), atol=1e-6)
    np.testing.assert_allclose(found[:, DYNAMIC["joints"]], 0, atol=1e-6)


def test_a_turned_and_moved_world_tells_the_same():
    yaw, shift = from_axis_angle(np.array([0, 2.0, 0])), np.array([3.0, 0.0, -5.0])
    motion = clip()
    turned = replace(
        motion,
        rotations=np.concatenate([multiply(yaw, motion.rotations[:, :1]), motion.rotations[:, 1:]], axis=1),
        translations=(rotate(yaw, motion.translations) + shift).astype(np.float32),
    )
    (one, first), (other, second) = features_of(proxy(), motion), features_of(proxy(), turned)
    np.testing.assert_allclose(rotate(yaw, one.skinned) + shift, other.skinned, atol=2e-5)
    # of two cones that are equally near, either may be the nearest
    assert (np.abs(first - second) < 2e-3).mean() > 0.999
    assert np.abs(first[:, : DYNAMIC["carried trail"].stop]).mean() > 0.01


def test_vectors_are_in_the_rotated_frame():
    trail, found = features_of(proxy(), clip())
    back = np.swapaxes(to_matrix(trail.turns.astype(np.float64)), 1, 2)
    apart = np.einsum("vij,vj->vi", back, (trail.carried - trail.skinned).astype(np.float64))
    limited = apart / np.sqrt(1 + (apart**2).sum(axis=1, keepdims=True) / 0.25)
    np.testing.assert_allclose(found[:, DYNAMIC["carried"]], limited, atol=1e-5)


def test_the_mirrored_garment_in_the_mirrored_motion_has_the_mirrored_features():
    made, garment = proxy(), proxy().garment
    signs = np.array([-1, 1, 1], np.float32)
    flipped = replace(
        garment,
        vertices=garment.vertices * signs,
        faces=np.ascontiguousarray(garment.faces[:, [0, 2, 1]]),
        rest_edges=np.ascontiguousarray(garment.rest_edges[:, ::-1, ::-1] * np.array([[1], [1]])),
    )
    other = ProxyOnBody.of(flipped, flipped.vertices, body())
    _, plain = features_of(made, clip())
    _, mirrored = features_of(other, mirror_motion(clip()))
    order, sign = DYNAMIC.mirror()
    expected = plain[:, order] * sign
    # the body itself is symmetric to some millimetres
    assert np.abs(mirrored - expected).mean() < 0.012
    assert np.abs(mirrored - plain).mean() > 0.04
    order, sign = STATIC.mirror()
    assert np.abs(other.static - made.static[:, order] * sign).mean() < 0.006
    assert other.static.shape[1] == STATIC.count


def test_how_a_garment_lay_is_mirrored_with_it():
    """Both fields by the world: a garment displaced one way, and its mirror image displaced the mirrored way."""
    posed = body().posed(body().rest_pose)
    trail, way = Trail.start(proxy(), posed), np.float32([0.05, -0.02, 0.03])
    flip = np.float32([-1, 1, 1])
    one = trail.with_beginning(trail.skinned + way).features(proxy(), posed)
    other = trail.with_beginning(trail.skinned + flip * way).features(proxy(), posed)
    order, sign = DYNAMIC.mirror()
    np.testing.assert_allclose(
        other[:, DYNAMIC["beginning"]], (one[:, order] * sign)[:, DYNAMIC["beginning"]], atol=1e-5
    )
    np.testing.assert_allclose(one[:, DYNAMIC["beginning"]], np.tile([*way, 1], (len(one), 1)), atol=1e-5)


@pytest.mark.parametrize("table", [DYNAMIC, STATIC, VERTEX])
def test_the_features_of_a_table_lie_side_by_side(table):
    places = [table[each.name] for each in table.features]
    covered = np.concatenate([np.arange(table.count)[place] for place in places])
    np.testing.assert_array_equal(covered, np.arange(table.count))


def test_the_estimator_is_given_each_feature_in_its_columns():
    random = np.random.default_rng(0)
    dynamic, static = (random.normal(size=(5, each.count)).astype(np.float32) for each in (DYNAMIC, STATIC))
    found = vertex_inputs(dynamic, static)
    for table, given in ((DYNAMIC, dynamic), (STATIC, static)):
        for each in table.features:
            np.testing.assert_array_equal(found[:, VERTEX[each.name]], given[:, table[each.name]])


def test_mirrors_undo_themselves():
    for order, sign in (DYNAMIC.mirror(), STATIC.mirror(), VERTEX.mirror()):
        np.testing.assert_array_equal(order[order], np.arange(len(order)))
        np.testing.assert_array_equal(sign[order] * sign, 1)


def test_soft_weights_are_the_gaussian_mean_of_the_skin():
    rest = proxy().rest[::40]
    found = soft_weights(rest, body().body, body().vertices).dense()
    shares = np.zeros((len(body().vertices), 24))
    np.add.at(shares, (np.arange(len(shares))[:, None], body().body.weight_indices), body().body.weights)
    for vertex, point in enumerate(rest.astype(np.float64)):
        squared = ((body().vertices - point) ** 2).sum(axis=1)
        breadth = max(MIN_BLUR, BLUR_FRACTION * np.sqrt(squared.min()))
        weights = np.exp((squared.min() - squared) / (2 * breadth**2)) @ shares
        np.testing.assert_allclose(found[vertex], weights / weights.sum(), atol=2e-3)
    np.testing.assert_allclose(found.sum(axis=1), 1, atol=1e-6)


def test_cells_share_out_all_of_the_garment():
    cells = Cells.of(proxy().garment)
    assert set(cells.cell) == set(range(cells.count))
    np.testing.assert_allclose(cells.shares.sum(axis=1), 1, atol=1e-6)
    np.testing.assert_array_equal(cells.near[:, 0], cells.cell)
    assert (np.diff(cells.shares, axis=1) <= 1e-6).all()


@pytest.mark.parametrize("far", [0.0, 50.0])
def test_nearness_is_that_of_the_cones(far):
    from hemline.collide.primitives.body_primitives import BodyPrimitives

    motion = clip()
    posed = body().posed(Pose(motion.rotations[10], motion.translations[10] + np.float32([far, 0, 0])))
    trail = Trail.start(proxy(), posed)
    found = trail.features(proxy(), posed)
    nearest = 1 - BodyPrimitives.fit(body()).distances(trail.skinned, posed.transforms)[0] / 0.3
    near = found[:, DYNAMIC["nearness"]][:, ::4].max(axis=1)
    seen = nearest > 0.01
    assert seen.sum() > 50
    np.testing.assert_allclose(near[seen], nearest[seen], atol=1e-4)
