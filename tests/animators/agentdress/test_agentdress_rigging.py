"""Sensitivity-optimised rigging: skin weights that reproduce given derivatives."""

import numpy as np
import pytest

from hemline.animators.agentdress.sor.rigging import (
    MOST_BONES,
    Rigging,
    _descendants,
    _tree,
    optimize_weights,
    relative_transforms,
    rigid_derivatives,
    skin_points,
)
from hemline.animators.agentdress.sor.rigging_kernels import minimize_on_simplex
from hemline.motions import Pose
from hemline.motions.motion import JOINT_COUNT
from hemline.motions.quaternions import from_axis_angle, multiply
from tests.animators import formula_garment as made


def posed(number: int):
    return made.body().posed(made.random_pose(number))


def random_weights(count: int, bones: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    weights = np.zeros((count, JOINT_COUNT))
    for row in weights:
        row[random.choice(JOINT_COUNT, bones, replace=False)] = random.dirichlet(np.ones(bones))
    return weights


def test_rigid_derivatives_equal_skinning_by_one_joint():
    """Finite differences of the bone transforms give the same derivatives."""
    before, points = posed(3), made.lifted_garment(made.random_pose(3)).astype(np.float64)
    found = rigid_derivatives(before, points)
    for joint in (0, made.SPINE, made.SHOULDER, made.ELBOW):
        for axis in range(3):
            rotations = before.pose.rotations.astype(np.float64)
            rotations[joint] = multiply(rotations[joint], from_axis_angle(1e-4 * np.eye(3)[axis]))
            after = made.body().posed(Pose(rotations, before.pose.translation))
            alone = np.zeros((len(points), JOINT_COUNT))
            alone[:, joint] = 1.0
            moved = (
                skin_points(relative_transforms(after.transforms, before.transforms.astype(np.float64)), alone, points)
                - points
            )
            np.testing.assert_allclose(found[joint, axis], moved / 1e-4, atol=8e-3)


@pytest.mark.parametrize("stiffness", [0.0, 1e-6])
def test_weights_are_recovered_from_their_derivatives(stiffness):
    body, points = posed(4), made.lifted_garment(made.random_pose(4)).astype(np.float64)[:40]
    truth = random_weights(40, 3)
    turns = rigid_derivatives(body, points)
    derivatives = np.einsum("vb,jb,javi->javi", truth, _descendants(), turns)
    start = random_weights(40, 5, seed=1)
    found = optimize_weights(turns, derivatives, start, stiffness)
    told = np.einsum("vb,jb,javi->javi", found, _descendants(), turns)
    begun = np.einsum("vb,jb,javi->javi", start, _descendants(), turns)
    assert np.linalg.norm(told - derivatives) < 0.05 * np.linalg.norm(begun - derivatives)
    np.testing.assert_allclose(found.sum(axis=1), 1, atol=1e-9)
    assert (found >= 0).all() and ((found > 0).sum(axis=1) <= MOST_BONES).all()


def test_stiff_rigging_keeps_the_weights_of_the_body():
    body, points = posed(4), made.lifted_garment(made.random_pose(4)).astype(np.float64)[:20]
    turns, start = rigid_derivatives(body, points), random_weights(20, 4)
    kept = optimize_weights(turns, np.zeros_like(turns), start, 1e4)
    np.testing.assert_allclose(kept, start, atol=1e-3)
    assert np.abs(optimize_weights(turns, np.zeros_like(turns), start, 1e-3) - start).max() > 0.1


def test_minimum_on_the_simplex_equals_scipy():
    from scipy.optimize import minimize

    body, points = posed(5), made.lifted_garment(made.random_pose(5)).astype(np.float64)[:3]
    random = np.random.default_rng(1)
    turns = rigid_derivatives(body, points)
    derivatives, start = turns * random.uniform(0, 1, (JOINT_COUNT, 1, 3, 1)), random_weights(3, 4)
    found = optimize_weights(turns, derivatives, start, 0.05)

    def cost(weights, vertex):
        left = derivatives[:, :, vertex] - (_descendants() @ weights)[:, None, None] * turns[:, :, vertex]
        return (left**2).sum() + 0.05 * (turns[:, :, vertex] ** 2).sum() * ((weights - start[vertex]) ** 2).sum()

    for vertex in range(3):
        used = found[vertex] > 0
        bounds = [(0, 1 if each else 0) for each in used]
        best = minimize(
            cost, start[vertex], (vertex,), bounds=bounds, constraints={"type": "eq", "fun": lambda w: w.sum() - 1}
        )
        assert cost(found[vertex], vertex) <= best.fun * (1 + 1e-5) + 1e-12


def test_no_bone_lowers_the_cost_at_the_minimum():
    """The slopes of all weighted bones are equal, and those of the others not less (Karush, Kuhn, Tucker)."""
    random, parents, (tree, common) = np.random.default_rng(2), _descendants(), _tree()
    squares, linear = random.uniform(0, 1, (200, JOINT_COUNT)), random.normal(size=(200, JOINT_COUNT))
    stiffness, allowed = np.full(200, 1e-3), random.uniform(size=(200, JOINT_COUNT)) < 0.6
    allowed[:, 0] = True
    weights = allowed / allowed.sum(axis=1, keepdims=True)
    minimize_on_simplex(squares, linear, stiffness, tree, common, allowed, weights)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-12)
    assert (weights >= 0).all() and not weights[~allowed].any()
    hessian = np.einsum("jb,vj,jc->vbc", parents, squares, parents) + 1e-3 * np.eye(JOINT_COUNT)
    slopes = np.einsum("vbc,vc->vb", hessian, weights) - linear
    of_weights = (weights * slopes).sum(axis=1, keepdims=True)
    assert np.abs(slopes - of_weights)[weights > 0].max() < 1e-8
    assert (slopes - of_weights)[allowed].min() > -1e-7


def test_anchors_are_reproduced_and_a_rigid_garment_follows_its_bone():
    bodies = [posed(number) for number in (1, 2)]
    worn = np.array([made.lifted_garment(made.random_pose(number)) for number in (1, 2)], np.float64)
    start = made.binding().dense_weights()
    derivatives = [
        np.einsum("vb,jb,javi->javi", start, _descendants(), rigid_derivatives(b, w))
        for b, w in zip(bodies, worn, strict=True)
    ]
    rigging = Rigging.fit(bodies, worn, derivatives, start, 1e-2)
    for anchor in range(2):
        blend = np.zeros((len(start), 2))
        blend[:, anchor] = 1
        np.testing.assert_allclose(rigging.at(bodies[anchor].transforms, blend), worn[anchor], atol=1e-6)
    # derivatives of skinning give skinning
    there = posed(7)
    blend = np.tile([1.0, 0.0], (len(start), 1))
    plain = skin_points(relative_transforms(there.transforms, bodies[0].transforms.astype(np.float64)), start, worn[0])
    assert np.linalg.norm(rigging.at(there.transforms, blend) - plain, axis=1).max() < 2e-3
