"""Baselines of rope chains: the standard skinnings, and a net of masses and springs."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hemline import bodies, garments
from hemline.animators.base import Animator, Driven
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.errors import BadOutput
from papers.rope_chains.baselines import Baseline, BoneSkin, MassSpringNet
from papers.rope_chains.baselines.mass_spring import Springs
from papers.rope_chains.baselines.push_kernels import push_points_out

GRAVITY = 9.81


@functools.cache
def worn():
    body = bodies.load("anny24").shaped()
    garment = garments.make_cape(body, rows=12, columns=14)
    chains = tuple(tuple(row * 14 + column for row in range(1, 12, 2)) for column in (1, 5, 8, 12))
    garment = replace(garment, chains=chains)
    return body, garment, build_ropes(garment, body)


def skin() -> BoneSkin:
    body, garment, ropes = worn()
    return BoneSkin.near(ropes, garment.vertices, rest_bones(ropes, garment.vertices, body))


def at_rest():
    body, garment, ropes = worn()
    return garment.vertices, rest_bones(ropes, garment.vertices, body)


KEY = np.eye(4)[:3].astype(np.float32)


@pytest.mark.parametrize("blending", ["linear", "dual"])
def test_bones_that_move_rigidly_carry_the_garment_rigidly(blending):
    """This holds for any weights; bones without neighbours, which cannot rotate, have none."""
    rest, bones = at_rest()
    chosen = replace(skin(), blending=blending)
    turn, shift = Rotation.from_rotvec([0.3, -0.8, 0.2]).as_matrix(), np.array([0.4, 0.1, -0.2])
    lone = np.setdiff1d(np.arange(len(bones)), chosen.turns.links)
    weights = np.where(np.isin(chosen.bones, lone), 0, chosen.weights)
    order = np.argsort(-weights, axis=1, kind="stable")
    weights = np.take_along_axis(weights, order, 1) / weights.sum(1, keepdims=True)
    chosen = replace(chosen, bones=np.take_along_axis(chosen.bones, order, 1), weights=weights.astype(np.float32))
    moved = bones @ turn.T + shift - bones
    found = chosen.vertices(moved.astype(np.float32).reshape(-1), rest, bones, KEY)
    np.testing.assert_allclose(found, rest @ turn.T + shift, atol=5e-3)  # FIRM holds turns back a little


def test_a_garment_at_rest_is_the_drape_in_the_frame_of_its_key_joint():
    rest, bones = at_rest()
    key = np.concatenate([Rotation.from_rotvec([0, 1, 0]).as_matrix(), [[1.0], [2.0], [3.0]]], axis=1)
    found = skin().vertices(np.zeros(bones.size, np.float32), rest, bones, key.astype(np.float32))
    np.testing.assert_allclose(found, rest @ key[:, :3].T + key[:, 3], atol=1e-5)


def test_fitted_weights_are_shares_and_find_what_made_the_frames():
    rest, bones = at_rest()
    random = np.random.default_rng(0)
    near = skin()
    made_with = random.dirichlet(np.ones(near.bones.shape[1]), len(rest))
    order = np.argsort(-made_with, axis=1)
    truth = replace(
        near,
        bones=np.take_along_axis(near.bones, order, 1),
        weights=np.take_along_axis(made_with, order, 1).astype(np.float32),
    )
    moved = 0.1 * random.normal(size=(40, *bones.shape))
    seen = np.stack([truth.vertices(m.astype(np.float32).reshape(-1), rest, bones, KEY) - rest for m in moved])
    fitted = near.fit(moved, seen, rest, bones)
    assert (fitted.weights >= 0).all()
    np.testing.assert_allclose(fitted.weights.sum(axis=1), 1, atol=1e-5)

    def off(which):
        made = [which.vertices(m.astype(np.float32).reshape(-1), rest, bones, KEY) - rest for m in moved]
        return np.linalg.norm(np.stack(made) - seen, axis=2).mean()

    assert off(fitted) < 0.05 * off(near)


def test_a_mass_on_a_spring_hangs_by_its_weight_over_the_stiffness():
    for stiffness in (1.0, 50.0, 1e6):
        springs = Springs(np.array([[0, 1]]), np.array([0.5]), stiffness)
        x, masses = np.array([[0, 0, 0], [0, -0.5, 0.0]]), np.array([1.0, 0.02])
        for _ in range(60):  # without memory of velocities each step goes on towards the equilibrium
            aim = x + [[0, 0, 0], [0, -GRAVITY * 0.25**2, 0]]
            x = springs.step(x, aim, masses, np.array([1]), 0.25)
        assert -x[1, 1] == pytest.approx(0.5 + 0.02 * GRAVITY / stiffness, abs=2e-5)


def hung(stiffness) -> np.ndarray:
    """A square sheet of 5 by 5 nodes, 10 cm apart, pinned at the five nodes of its upper rim, which is gathered."""
    rows, columns = np.meshgrid(np.arange(5), np.arange(5), indexing="ij")
    flat = np.stack([0.1 * columns, -0.1 * rows, 0 * rows], axis=-1).reshape(-1, 3).astype(float)
    number = np.arange(25).reshape(5, 5)
    ends = np.concatenate(
        [
            np.stack([one.ravel(), two.ravel()], 1)
            for one, two in (
                (number[:-1], number[1:]),
                (number[:, :-1], number[:, 1:]),
                (number[:-1, :-1], number[1:, 1:]),
            )
        ]
    )
    springs = Springs(ends, np.linalg.norm(flat[ends[:, 0]] - flat[ends[:, 1]], axis=1), stiffness)
    x = flat + 0.01 * np.random.default_rng(0).normal(size=flat.shape)
    x[:5] = flat[:5] * [0.5, 1, 1]
    for _ in range(150):
        aim = x - [0, GRAVITY * 0.05**2, 0] * (np.arange(25) >= 5)[:, None]
        x = springs.step(x, aim, np.full(25, 0.02), np.arange(5, 25), 0.05)
    return x


def test_a_weak_net_stretches_and_a_stiff_one_locks():
    """Paper, Fig. 3: no stiffness gives both the length of ropes and the freedom to fold."""
    weak, stiff = hung(5.0), hung(5000.0)
    assert -weak[20:, 1].mean() > 1.2 * 0.4
    assert -stiff[20:, 1].mean() < 1.01 * 0.4
    width = [np.ptp(each[20:, 0]) for each in (weak, stiff)]
    assert width[1] > 1.15 * width[0]  # the lower rim stays as wide as the springs across are long


@pytest.mark.parametrize("stiffness", [1.0, 100.0, 1e6])
@pytest.mark.parametrize("dt", [1 / 24, 1 / 120])
def test_a_net_is_stable_at_any_stiffness_and_step(stiffness, dt):
    body, _, ropes = worn()
    net, posed = MassSpringNet.of(ropes, stiffness), body.posed(body.rest_pose)
    state, rest = net.start(posed), rest_bones(ropes, worn()[1].vertices, body)
    for _ in range(40):
        state, moved = net.step(state, posed, dt, rest)
    assert np.isfinite(moved).all()
    assert np.abs(moved).max() < (60 if stiffness == 1 else 2)
    distance, _ = ropes.primitives.distances(state.positions[ropes.parents >= 0], ropes.primitives.joint_frames(posed))
    assert (distance > np.minimum(ropes.chains.clearances[ropes.parents >= 0], 0.02) - 1e-6).mean() > 0.95


def test_a_net_has_the_weight_the_support_and_the_air_of_the_ropes():
    """In the settled drape the support of the ropes acts; a wind pulls along its own direction."""
    body, _, ropes = worn()
    posed = body.posed(body.rest_pose)
    frames = ropes.primitives.joint_frames(posed)
    calm = MassSpringNet.of(ropes, 50.0)
    wind = (3.0, 0.0, 2.0)
    blown = MassSpringNet.of(ropes.with_constants(replace(ropes.constants, wind=wind)), 50.0)
    state, free = calm.start(posed), ropes.parents >= 0
    still, windy = (net._accelerations(state, frames, 1 / 30)[free] for net in (calm, blown))
    balance = np.einsum("nab,nb->na", frames[ropes.key_index, None, :, :3], ropes.chains.balance[free])
    np.testing.assert_allclose(still, [0, -GRAVITY, 0] + balance, atol=0.5)
    assert (((windy - still) @ wind) > -1e-9).all()
    assert ((windy - still) @ wind).max() > 1.0


def test_a_baseline_is_an_animator_that_is_not_saved(tmp_path):
    from hemline import load, motions

    model = load("cape")
    body, run = bodies.load("anny24").shaped(), motions.load("run")
    own = Baseline.of(model, "own parts")
    assert isinstance(own, Animator) and isinstance(own, Driven)
    posed = [body.posed(run[k]) for k in range(3)]
    mine, its = own.start(posed[0]), model.start(posed[0])
    for each in posed[1:]:
        mine, vertices = own.step(mine, each, 1 / 30)
        its, expected = model.step(its, each, 1 / 30)
    np.testing.assert_array_equal(vertices, expected)
    _, driven = own.follow(mine, posed[2], 1 / 30, expected)
    np.testing.assert_array_equal(driven, model.follow(its, posed[2], 1 / 30, expected)[1])
    with pytest.raises(BadOutput, match="a baseline is not saved; got own parts"):
        own.save(tmp_path / "no.safetensors")


def test_the_push_goes_the_shortest_way_out_of_the_deepest_primitive():
    body, _, ropes = worn()
    primitives, posed = ropes.primitives, body.posed(body.rest_pose)
    frames = posed.transforms.astype(np.float64)
    random = np.random.default_rng(0)
    points = posed.joints[random.integers(0, 24, 200)] + 0.1 * random.normal(size=(200, 3))
    moved = points.copy()
    push_points_out(*primitives.colliders[:4], frames, np.full(len(moved), 0.02), moved)
    for point, found in zip(points, moved, strict=True):
        expected = pushed(primitives, frames, point.copy(), 0.02)
        np.testing.assert_allclose(found, expected, atol=1e-6)


def pushed(primitives, frames, point, margin):
    """The plain twin: distance by distance, gradient by differences."""
    for _ in range(4):
        distance = float(primitives.distances(point[None], frames)[0][0])
        if distance >= margin - 1e-12:
            break
        one = [primitives.distances(np.stack([point + d, point - d]), frames)[0] for d in 1e-6 * np.eye(3)]
        gradient = np.array([a - b for a, b in one]) / 2e-6
        point += (margin - distance) * gradient
    return point
