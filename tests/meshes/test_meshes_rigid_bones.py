"""Skinning decomposition and its shares: laws, and the same numbers by other ways."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from hemline.errors import BadInput
from hemline.meshes import fit_convex_weights, fit_weights, project_to_simplex, rigid_bones


def moved(rest, weights, frames, seed=0):
    """Vertices under linear blend skinning by bones that turn and move at random."""
    random, count = np.random.default_rng(seed), weights.shape[1]
    turns = Rotation.from_rotvec(random.normal(0, 0.4, (frames * count, 3))).as_matrix().reshape(frames, count, 3, 3)
    shifts = random.normal(0, 0.3, (frames, count, 3))
    return np.einsum("vb,fbij,vj->fvi", weights, turns, rest) + np.einsum("vb,fbi->fvi", weights, shifts)


def blended(count=6, verts=500):
    """A cloud whose vertices follow the two bones nearest to them."""
    random = np.random.default_rng(1)
    rest, centres = random.uniform(-1, 1, (verts, 3)), random.uniform(-1, 1, (count, 3))
    apart = ((rest[:, None] - centres) ** 2).sum(2)
    near = np.argsort(apart, axis=1)[:, :2]
    shares = 1 / (np.take_along_axis(apart, near, axis=1) + 0.01) ** 2
    weights = np.zeros((verts, count))
    np.put_along_axis(weights, near, shares / shares.sum(1, keepdims=True), axis=1)
    return rest, moved(rest, weights, 20)


def root_mean_square(made, frames):
    return np.sqrt(((made - frames) ** 2).sum(2).mean())


def test_pieces_that_move_rigidly_are_found_exactly():
    random = np.random.default_rng(2)
    rest, owner = random.uniform(-1, 1, (300, 3)), np.repeat(np.arange(5), 60)
    rest += 3 * owner[:, None] * [1.0, 0, 0]
    frames = moved(rest, np.eye(5)[owner], 12)
    bones = rigid_bones(rest, frames, 5)
    assert_allclose(bones.vertices(rest), frames, atol=1e-6)
    found = bones.weights.argmax(1)
    assert [len(set(found[owner == piece])) for piece in range(5)] == [1] * 5 and len(set(found)) == 5


def test_one_bone_is_the_best_rotation_of_scipy():
    rest, frames = blended()
    bones = rigid_bones(rest, frames, 1, passes=1)
    for turn, shift, seen in zip(bones.turns[:, 0], bones.shifts[:, 0], frames, strict=True):
        best, _ = Rotation.align_vectors(seen - seen.mean(0), rest - rest.mean(0))
        assert_allclose(turn, best.as_matrix(), atol=1e-6)
        assert_allclose(shift, seen.mean(0) - best.apply(rest.mean(0)), atol=1e-6)


def test_weights_and_transforms_in_turn_beat_clusters_and_weights_are_few_shares():
    rest, frames = blended()
    errors = [
        root_mean_square(rigid_bones(rest, frames, 6, passes=n, influences=2).vertices(rest), frames) for n in (0, 2, 8)
    ]
    assert errors[1] < 0.75 * errors[0] and errors[2] < 0.75 * errors[1]
    bones = rigid_bones(rest, frames, 6, influences=2)
    assert_allclose(bones.weights.sum(1), 1, atol=1e-9)
    assert bones.weights.min() >= 0 and (bones.weights > 0).sum(1).max() == 2
    assert_allclose(
        bones.turns @ np.swapaxes(bones.turns, -1, -2), np.broadcast_to(np.eye(3), (20, 6, 3, 3)), atol=1e-9
    )
    assert_allclose(np.linalg.det(bones.turns), 1)


def test_both_ways_of_summing_find_the_same_bones():
    rest, frames = blended()
    slow, quick = (rigid_bones(rest, frames, 6, travels=travels) for travels in (False, True))
    assert root_mean_square(quick.vertices(rest), frames) < 1.1 * root_mean_square(slow.vertices(rest), frames)
    again = fit_weights(quick._replace(weights=quick.weights[:200]), rest, frames, travels=True)
    assert root_mean_square(again.vertices(rest), frames) < 1.3 * root_mean_square(quick.vertices(rest), frames)


def test_no_bone_is_left_without_cloth():
    rest = np.random.default_rng(5).uniform(-1, 1, (300, 3))
    still = np.repeat(rest[None], 3, axis=0)  # all bones fit alike
    bones = rigid_bones(rest, still, 12, passes=0)
    assert (np.bincount(bones.weights.argmax(1), minlength=12) > 0).all()


def test_a_turned_world_turns_the_bones():
    rest, frames = blended(3, 120)
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
    as_is, turned = rigid_bones(rest, frames, 3), rigid_bones(rest @ turn.T, frames @ turn.T, 3)
    assert_allclose(turned.weights, as_is.weights, atol=1e-6)
    assert_allclose(turned.vertices(rest @ turn.T), as_is.vertices(rest) @ turn.T, atol=1e-6)


@pytest.mark.parametrize(("count", "frames"), [(0, 5), (200, 5), (3, 0)])
def test_what_cannot_be_decomposed_is_refused(count, frames):
    with pytest.raises(BadInput, match="three vertices for each bone"):
        rigid_bones(np.zeros((300, 3)), np.zeros((frames, 300, 3)), count)


def test_shares_are_those_of_a_general_solver():
    random = np.random.default_rng(3)
    made, wanted = random.normal(size=(7, 5, 12)), random.normal(size=(7, 12))
    square, along = made @ np.swapaxes(made, 1, 2), np.einsum("vkm,vm->vk", made, wanted)
    found = fit_convex_weights(square, along, np.full((7, 5), 0.2))
    assert_allclose(found.sum(1), 1)
    for shares, each, goal in zip(found, made, wanted, strict=True):
        best = minimize(
            lambda w, each=each, goal=goal: ((w @ each - goal) ** 2).sum(),
            np.full(5, 0.2),
            bounds=[(0, 1)] * 5,
            constraints={"type": "eq", "fun": lambda w: w.sum() - 1},
            method="SLSQP",
        )
        assert_allclose(shares, best.x, atol=2e-3)


def test_the_nearest_shares_keep_shares_and_are_nearest():
    random = np.random.default_rng(4)
    shares = random.dirichlet(np.ones(6), 20)
    assert_allclose(project_to_simplex(shares), shares, atol=1e-12)
    far = random.normal(size=(20, 6))
    nearest = project_to_simplex(far)
    others = random.dirichlet(np.ones(6), (500, 20))
    assert (((nearest - far) ** 2).sum(1) <= ((others - far) ** 2).sum(2) + 1e-12).all()
