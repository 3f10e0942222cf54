"""Bones that the body carries, on cloth that follows it, and the chains that hang from the lowest of them."""

import functools
from dataclasses import replace

import numpy as np

from hemline import bodies
from hemline.animators.ropes.bones.embedding import Carriage, NodeEmbedding
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.ropes.layout.plan import BonePlan, FramesInKey
from hemline.garments.generate import Design, generate_garment
from hemline.motions import JOINT_NAMES


@functools.cache
def shaped():
    return bodies.load("anny24").shaped()


@functools.cache
def blouse():
    """A generated top with sleeves."""
    return generate_garment(Design(kind="top", length=0.6, sleeve=0.4, ease=0.16, waist_ease=0.2), shaped(), edge=0.045)


def sleeves_up():
    """Frames of a top whose arms are raised by degrees: its sleeves go along, and its hem swings away."""
    top, body = blouse(), shaped()
    transforms, vertices = [], []
    for angle in np.linspace(0, 0.6, 12):
        pose = body.rest_pose
        rotations = np.array(pose.rotations)
        for side, sign in (("left_shoulder", 1.0), ("right_shoulder", -1.0)):
            half = sign * angle / 2
            rotations[JOINT_NAMES.index(side)] = [np.cos(half), 0.0, 0.0, np.sin(half)]
        posed = body.posed(replace(pose, rotations=rotations.astype(np.float32)))
        skin = posed.transforms.astype(np.float64)
        carried = Carriage.of(top.vertices, body).positions_in(skin, top.vertices.astype(np.float64))
        low = np.clip((top.vertices[:, 1].max() - 0.3 - top.vertices[:, 1]) / 0.2, 0, 1)
        low = np.where(np.abs(top.vertices[:, 0]) < 0.25, low, 0)
        carried[:, 2] += 0.4 * low * np.sin(10 * angle)
        transforms.append(skin)
        vertices.append(carried)
    return top, FramesInKey(np.array(vertices), np.array(transforms))


def test_the_body_carries_the_bones_of_sleeves_and_chains_hang_where_cloth_swings():
    top, frames = sleeves_up()
    options = {"frames": frames.vertices, "chain_count": 10, "bone_counts": (6, 6), "scattered": True}
    plain, ropes = build_ropes(top, shaped(), **options), build_ropes(top, shaped(), **options, carry=frames)
    assert ropes.node_count == plain.node_count
    free = ropes.parents >= 0
    on_sleeve = np.abs(ropes.rest[:, 0]) > 0.3
    assert on_sleeve.any() and not free[on_sleeve].any()
    lowest = ropes.rest[:, 1] < top.vertices[:, 1].min() + 0.1
    assert free[lowest & ~on_sleeve].mean() > 0.8
    # bones that the body carries are where the cloth is
    posed = ropes.kinematic_paths(frames.transforms, shaped())
    shown = ropes.positions_on(frames.vertices)[:, ropes.kinematic]
    assert np.linalg.norm(posed - shown, axis=2).mean() < 0.03
    state = moved = ropes.start(shaped().posed(shaped().rest_pose))
    for _ in range(5):
        moved = ropes.step(moved, shaped().posed(shaped().rest_pose), 1 / 30)
    np.testing.assert_allclose(moved.positions, state.positions, atol=1e-4)  # the drape is an equilibrium


def test_chains_hang_from_the_lowest_bone_that_the_body_carries():
    """One bone on no chain, chains of bones 1 to 5 and 6 to 8: the body carries 0, the roots, 3 and all of the last."""
    offsets, pairs = np.array([1, 6, 9], np.int32), np.array([[2, 7], [4, 5], [5, 8]], np.int32)
    lengths = np.array([0, 0, 0.1, 0.2, 0.3, 0.4, 0, 0.5, 0.6])
    plan = BonePlan(NodeEmbedding.at_vertices(np.arange(9)), offsets, lengths, pairs, np.array([1.0, 2.0, 3.0]))
    same = plan.carry(np.zeros(9, bool))
    np.testing.assert_array_equal(same.embedding.corners, plan.embedding.corners)
    for one, other in zip(same[1:], plan[1:], strict=True):
        np.testing.assert_array_equal(one, other)
    some = plan.carry(np.isin(np.arange(9), [0, 1, 3, 6, 7, 8]))
    np.testing.assert_array_equal(some.embedding.corners[:, 0], [0, 6, 7, 8, 1, 2, 3, 4, 5])
    np.testing.assert_array_equal(some.offsets, [4, 6, 9])
    np.testing.assert_array_equal(some.lengths, [0, 0, 0, 0, 0, 0.1, 0, 0.3, 0.4])
    np.testing.assert_array_equal(some.pairs, [[7, 8]])
    np.testing.assert_array_equal(some.pair_lengths, [2.0])


def test_cloth_that_swings_nowhere_still_has_a_chain():
    top, body = blouse(), shaped()
    skin = np.stack([body.posed(body.rest_pose).transforms.astype(np.float64)] * 3)
    still = FramesInKey(np.stack([top.vertices.astype(np.float64)] * 3), skin)
    ropes = build_ropes(
        top, body, frames=sleeves_up()[1].vertices, chain_count=10, bone_counts=(5, 5), scattered=True, carry=still
    )
    assert len(ropes.chains.offsets) == 2 and (ropes.parents >= 0).sum() == 1
