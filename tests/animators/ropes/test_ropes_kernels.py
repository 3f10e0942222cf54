"""Kernels of the ropes against plain NumPy and scipy."""

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation, Slerp

from hemline.animators.ropes.mechanics import joint_frame_kernels as joint_frames
from hemline.animators.ropes.mechanics import placed_kernels, turn_kernels
from hemline.animators.ropes.mechanics import push_out_kernels as collisions
from hemline.animators.ropes.mechanics import rope_force_kernels as forces
from hemline.animators.ropes.mechanics import rope_frame_kernels as rope_frames
from hemline.animators.ropes.mechanics import tension_kernels as tension
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.animators.ropes.mechanics.dynamics import RopeChains
from hemline.animators.ropes.mechanics.kernel_inputs import BodyMotion, Chains, RopeGeometry
from hemline.collide.primitives.body_primitives import BodyPrimitives
from hemline.collide.primitives.distances import round_cone, round_cone_shape


def random_chain(rng, count):
    positions = np.cumsum(rng.normal(0, 0.1, (count, 3)), axis=0)
    return positions, rng.normal(0, 1, (count, 3)), rng.uniform(0.2, 3, count)


def geometry(positions, masses, lengths=None):
    count = len(positions)
    ropes = np.diff(positions, axis=0)
    spans = np.linalg.norm(ropes, axis=1)
    directions, measured, taut = np.zeros((count, 3)), np.zeros(count), np.zeros(count, np.bool_)
    lengths = np.append(0, spans) if lengths is None else lengths
    tension.rope_directions(positions, lengths, 1e-5, directions, measured, np.zeros(count), taut)
    np.testing.assert_allclose(directions[1:], ropes / spans[:, None], atol=1e-14)
    np.testing.assert_allclose(measured[1:], spans)
    inverse = 1 / masses
    inverse[0] = 0
    diagonal, beside = np.zeros(count), np.zeros(count)
    tension.rope_matrix(directions, inverse, diagonal, beside)
    return directions, spans, taut, inverse, diagonal, beside


def demand(directions, spans, inverse, velocities, accelerations, h, ahead):
    """The right-hand side of Eq. 4 for taut ropes without tension."""
    none, wanted = np.zeros(len(spans)), np.zeros(len(spans))
    ropes = RopeGeometry(directions, spans, none, none, none, np.ones(len(spans), np.bool_))
    tension.tension_demand(ropes, inverse, none, velocities, accelerations, h, ahead, wanted)
    return wanted


def chains_of(offsets, inverse_masses, **arrays):
    """Chains without springs, balance and sides, except for the given arrays."""
    nodes = len(inverse_masses)
    flat, vectors = np.zeros(nodes), np.zeros((nodes, 3))
    own = np.repeat(np.arange(nodes, dtype=np.int32)[:, None], 2, axis=1)
    pairs, joints = np.zeros((0, 2), np.int32), np.zeros(len(offsets) - 1, np.int32)
    kinematic = offsets[:-1]
    none = Chains(
        offsets, flat, flat, vectors, inverse_masses, flat, joints, own, pairs, flat[:0, None], vectors, flat, kinematic
    )
    return none._replace(**arrays)


def dense(diagonal, beside):
    return np.diag(diagonal[1:]) + np.diag(beside[1:-1], 1) + np.diag(beside[1:-1], -1)


def test_the_matrix_is_that_of_the_constraints():
    rng = np.random.default_rng(0)
    positions, _, masses = random_chain(rng, 9)
    directions, _, _, inverse, diagonal, beside = geometry(positions, masses)
    jacobian = np.zeros((8, 9, 3))
    for i in range(1, 9):
        jacobian[i - 1, i], jacobian[i - 1, i - 1] = directions[i], -directions[i]
    full = np.einsum("ank,n,bnk->ab", jacobian, inverse, jacobian)
    np.testing.assert_allclose(dense(diagonal, beside), full, atol=1e-12)


@pytest.mark.parametrize("seed", range(30))
def test_the_direct_solve_is_the_complementary_one_and_sweeps_come_to_it(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 16))
    positions, _, masses = random_chain(rng, count)
    _, _, _, _, diagonal, beside = geometry(positions, masses)
    matrix, wanted = dense(diagonal, beside), np.append(0, rng.normal(0, 1, count - 1))
    taut = rng.uniform(size=count) < 0.8
    taut[0] = False
    held = np.zeros(count, np.bool_)
    values, active, upper = np.zeros(count), np.zeros(count, np.bool_), np.zeros(count)
    tension.solve_direct(diagonal, beside, wanted, taut, held, values, active, upper)
    used = np.flatnonzero(taut) - 1
    # min |L^T x - L^-1 b| over x >= 0 has the conditions x >= 0, A x >= b, x (A x - b) = 0
    part = matrix[np.ix_(used, used)]
    lower = np.linalg.cholesky(part) if len(used) else part
    expected = np.zeros(count - 1)
    if len(used):
        expected[used] = nnls(lower.T, np.linalg.solve(lower, wanted[1:][used]))[0]
    np.testing.assert_allclose(values[1:], expected, atol=1e-9)
    swept = np.zeros(count)
    tension.solve_sweeps(diagonal, beside, wanted, taut, held, 4000, float(seed % 2), swept)
    np.testing.assert_allclose(swept, values, atol=1e-7)


def test_held_ropes_are_solved_as_equations():
    rng = np.random.default_rng(1)
    positions, velocities, masses = random_chain(rng, 8)
    directions, _, _, inverse, diagonal, beside = geometry(positions, masses)
    every = np.ones(8, np.bool_)
    every[0] = False
    wanted, values, active, upper = np.zeros(8), np.zeros(8), np.zeros(8, np.bool_), np.zeros(8)
    tension.impulse_demand(directions, np.zeros(8), velocities, 1 / 60, wanted)
    np.testing.assert_allclose(wanted[1:], (np.diff(velocities, axis=0) * directions[1:]).sum(1))
    tension.solve_direct(diagonal, beside, wanted, every, every, values, active, upper)
    np.testing.assert_allclose(values[1:], np.linalg.solve(dense(diagonal, beside), wanted[1:]))
    tension.apply_tensions(directions, inverse, values, 1.0, velocities)
    assert np.abs((np.diff(velocities, axis=0) * directions[1:]).sum(1)).max() < 1e-12


def test_demands_are_eq_1_and_4_for_equal_masses():
    rng = np.random.default_rng(2)
    positions, velocities, _ = random_chain(rng, 7)
    mass, accelerations = 0.4, rng.normal(0, 5, (7, 3))
    directions, spans, _, inverse, *_ = geometry(positions, np.full(7, mass))
    wanted = demand(directions, np.append(0, spans), inverse, velocities, accelerations, 0.0, 0.0)
    for i in range(1, 7):
        # Eq. 1: centripetal force about the centre of mass; the root has infinite mass
        first = i == 1
        centre = positions[0] if first else (positions[i - 1] + positions[i]) / 2
        drift = velocities[0] if first else (velocities[i - 1] + velocities[i]) / 2
        v = velocities[i] - drift
        across = v - (v @ directions[i]) * directions[i]
        force = mass * (across @ across) / np.linalg.norm(positions[i] - centre)
        pulled = mass * (accelerations[i] - accelerations[i - 1]) @ directions[i]
        assert mass * wanted[i] == pytest.approx(pulled + (force if first else 2 * force))


@pytest.mark.parametrize("h", [1e-5, 1e-4])
def test_finite_turns_come_to_eq_1(h):
    rng = np.random.default_rng(2)
    positions, velocities, _ = random_chain(rng, 7)
    directions, spans, _, inverse, *_ = geometry(positions, np.ones(7))
    still, spans = np.zeros((7, 3)), np.append(0, spans)
    exact = demand(directions, spans, inverse, velocities, still, 0.0, 0.0)
    near = demand(directions, spans, inverse, velocities, still, h, 0.5 * h)
    away = np.append(0, (np.diff(velocities, axis=0) * directions[1:]).sum(1))
    np.testing.assert_allclose(near - 2 / h * np.minimum(away, 0), exact, rtol=1e-3, atol=1e-4)


def test_a_node_turns_on_its_sphere_as_a_rotation_does():
    rng = np.random.default_rng(3)
    for _ in range(50):
        offset, velocity = rng.normal(size=3), rng.normal(size=3)
        length, time = 0.7, float(rng.uniform(0, 2))
        unit = offset / np.linalg.norm(offset)
        across = velocity - (velocity @ unit) * unit
        axis = np.cross(unit, across) / np.linalg.norm(across)
        turn = Rotation.from_rotvec(axis * np.linalg.norm(across) * time / length)
        found = turn_kernels.turn_about(*offset, *velocity, time, length)
        np.testing.assert_allclose(found, turn.apply(unit) * length, atol=1e-12)
    assert np.linalg.norm(turn_kernels.turn_about(0.3, 0, 0, 5, 0, 0, 1.0, 0.7)) == pytest.approx(0.7)


def test_a_slack_node_flies_until_its_rope_is_taut_and_turns_from_there():
    starts = np.array([[0.0, 0, 0], [0.6, 0, 0]])
    velocities = np.array([[0.0, 0, 0], [1.0, 1.0, 0]])
    after = np.zeros((2, 3))
    turn_kernels.move_node(1, 1.0, False, False, 0.1, starts, velocities, after)
    np.testing.assert_allclose(after[1], [0.7, 0.1, 0])
    turn_kernels.move_node(1, 1.0, False, False, 1.0, starts, velocities, after)
    root = (-0.6 + np.sqrt(0.36 + 2 * 0.64)) / 2
    taut = np.array([0.6 + root, root])
    turn = abs(taut[0] - taut[1]) * (1 - root)
    angle = np.arctan2(taut[1], taut[0]) + turn
    np.testing.assert_allclose(after[1], [np.cos(angle), np.sin(angle), 0], atol=1e-12)


def test_frames_between_go_straight_and_turn_evenly():
    rng = np.random.default_rng(4)
    turns = Rotation.random(10, random_state=1)
    pivots = rng.normal(size=(5, 3))
    poses = [np.concatenate([turns[k : k + 5].as_matrix(), rng.normal(size=(5, 3, 1))], axis=2) for k in (0, 5)]
    found = np.zeros((5, 3, 4))
    for fraction in (0.0, 0.3, 1.0):
        joint_frames.frames_between(*poses, pivots, fraction, found)
        for j in range(5):
            slerp = Slerp([0, 1], Rotation.concatenate([turns[j], turns[j + 5]]))(fraction).as_matrix()
            np.testing.assert_allclose(found[j, :, :3], slerp, atol=1e-7)
            ends = [pose[j, :, :3] @ pivots[j] + pose[j, :, 3] for pose in poses]
            middle = found[j, :, :3] @ pivots[j] + found[j, :, 3]
            np.testing.assert_allclose(middle, ends[0] + fraction * (ends[1] - ends[0]), atol=1e-7)


def test_carried_nodes_are_skinned():
    rng = np.random.default_rng(5)
    weights, rest, frames = rng.dirichlet(np.ones(4), 6), rng.normal(size=(6, 3)), rng.normal(size=(4, 3, 4))
    found = np.zeros((6, 3))
    rope_frames.carry_nodes(weights, rest, frames, found)
    blended = np.einsum("kj,jab->kab", weights, frames)
    np.testing.assert_allclose(found, np.einsum("kab,kb->ka", blended[:, :, :3], rest) + blended[:, :, 3], atol=1e-12)
    j, pivots = 2, rng.normal(size=(4, 3))
    moved = rng.normal(size=(4, 3, 4))
    path = (moved[j] - frames[j]) @ np.append(pivots[j], 1)
    assert rope_frames.squared_displacement(frames, moved, j, pivots) == pytest.approx(path @ path)


@pytest.mark.parametrize("reach", [0.0, 0.4])
def test_external_accelerations_equal_numpy(reach):
    rng = np.random.default_rng(6)
    offsets = np.array([1, 5, 9], np.int32)
    x, v = rng.normal(0, 0.2, (9, 3)), rng.normal(0, 1, (9, 3))
    inverse = 1 / rng.uniform(0.5, 2, 9)
    inverse[[0, 1, 5]] = 0
    pairs, spans = np.array([[2, 6], [3, 7], [4, 8]], np.int32), rng.uniform(0.1, 0.3, (3, 2))
    spans.sort(1)
    rest_spans, push, h = rng.uniform(0.1, 0.6, 9), rng.normal(size=(9, 3)), 1 / 60
    constants = RopeConstants(
        drag=1.3,
        lateral=30,
        lateral_stretch=90,
        shrink=50,
        parent_damping=2.0,
        wind=(1, 2, 3),
        air_drag=2,
        air_lift=0.7,
        root_damping=8.0,
        bend_damping=3.0,
        lateral_damping=2.0,
        balance_reach=reach,
    )
    numbers = constants.numbers()
    springs, found = np.zeros((9, 3)), np.zeros((9, 3))
    frames = Rotation.random(2, random_state=0).as_matrix()
    down = np.tile([0.0, -1, 0], (9, 1))
    balance, loads, tensions = rng.normal(0, 5, (9, 3)), rng.uniform(1, 30, 9), rng.uniform(0, 20, 9)
    across = np.array([[i, i] for i in range(9)], np.int32)
    across[pairs[:, 1], 0], across[pairs[:, 0], 1] = pairs[:, 0], pairs[:, 1]
    chains = chains_of(
        offsets,
        inverse,
        rest_spans=rest_spans,
        rest_directions=down,
        pairs=pairs,
        pair_spans=spans,
        across=across,
        balance=balance,
        rest_loads=loads,
    )
    forces.spring_accelerations(chains, numbers, h, frames, push, tensions, x, springs)
    forces.external_accelerations(chains, numbers, h, springs, x, v, found)

    expected = np.array(constants.gravity) + push
    for i in (2, 3, 4, 6, 7, 8):
        load = 9.81 / inverse[i] + (0 if i in (4, 8) else tensions[i + 1])
        root, turn = (1, frames[0]) if i < 5 else (5, frames[1])
        at_rest = x[root] + turn @ (rest_spans[root + 1 : i + 1, None] * down[root + 1 : i + 1]).sum(axis=0)
        off = (x[i] - at_rest) @ (turn @ balance[i]) / np.linalg.norm(balance[i])
        kept = np.clip(1 - off / reach, 0, 1) if reach else 1
        expected[i] += kept * min(load / loads[i], 1) * turn @ balance[i]

    def add(a, b, relative, path):
        fraction = inverse[a] + inverse[b]
        expected[a] -= relative * inverse[a] / fraction * path
        expected[b] += relative * inverse[b] / fraction * path

    soft, both = (k / (1 + k * h * h / 0.4) for k in (30.0, 120.0))
    for (a, b), (rest, longest) in zip(pairs, spans, strict=True):
        span = np.linalg.norm(x[b] - x[a])
        add(a, b, soft * (rest - span) + (both - soft) * min(longest - span, 0), (x[b] - x[a]) / span)
    for i in (2, 3, 4, 6, 7, 8):
        span = np.linalg.norm(x[i] - x[i - 1])
        if span < rest_spans[i]:
            add(i - 1, i, 50 / (1 + 50 * h * h / 0.3) * (rest_spans[i] - span), (x[i] - x[i - 1]) / span)
    for i, a, b, rate in [(k, k - 1, k + 1, 3.0) for k in (2, 3, 6, 7)]:
        away = rate / (1 + 4 * h * rate) * (v[i] - (v[a] + v[b]) / 2) / inverse[i]
        for node, fraction in ((i, -1), (a, 0.5), (b, 0.5)):
            expected[node] += fraction * inverse[node] * away
    wind = np.array([1.0, 2, 3])
    for i in (2, 3, 4, 6, 7, 8):
        damping = 2.0 + 8.0 * np.exp(-(i - (2 if i < 5 else 6)))
        towards = (1.3 * wind + damping * v[i - 1]) / (1.3 + damping)
        expected[i] += (1 - np.exp(-0.5 * h * (1.3 + damping))) / (0.5 * h) * (towards - v[i])
        below = min(i + 1, 4 if i < 5 else 8)
        normal = np.cross(x[below] - x[i - 1], x[across[i, 1]] - x[across[i, 0]])
        if np.linalg.norm(normal) > 1e-12:
            normal /= np.linalg.norm(normal)
            u = wind - v[i]
            facing, speed = u @ normal, np.linalg.norm(u)
            plain, lifted = abs(facing) * (2 - 0.7 * abs(facing) / speed), 0.7 * speed
            expected[i] += (plain * u + lifted * facing * normal) / (1 + 0.5 * h * (plain + lifted))
        np.testing.assert_allclose(found[i], expected[i], atol=1e-10)


def test_rest_angles_rest_at_rest_and_turn_with_the_root():
    rng = np.random.default_rng(7)
    offsets = np.array([0, 6], np.int32)
    rest = np.cumsum(rng.normal(0, 0.1, (6, 3)), axis=0)
    directions = np.diff(rest, axis=0, prepend=rest[:1] - [0, 1, 0])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    numbers = RopeConstants(rest_angle=100.0).numbers()
    turn = Rotation.random(random_state=3).as_matrix()
    found = np.zeros((6, 3))
    chains = chains_of(offsets, np.ones(6), rest_directions=directions)
    forces.add_rest_angles(chains, numbers, 1 / 60, turn[None].copy(), rest @ turn.T, found)
    assert np.abs(found).max() < 1e-9
    bent = rest @ turn.T
    bent[5] += [0.05, 0.02, 0]
    forces.add_rest_angles(chains, numbers, 1 / 60, turn[None].copy(), bent, found)
    np.testing.assert_allclose(found.sum(0), 0, atol=1e-12)
    assert found[5] @ (rest[5] @ turn.T - bent[5]) > 0


def test_the_contact_velocity_is_eq_14_to_16():
    rng = np.random.default_rng(8)
    for _ in range(40):
        normal, velocity, body = rng.normal(size=(3, 3))
        normal /= np.linalg.norm(normal)
        friction = float(rng.uniform(0, 1))
        found = velocity.copy()
        collisions.contact_velocity(*normal, *body, friction, found)
        along, new = velocity @ normal, max(velocity @ normal, body @ normal)
        slide = body - (body @ normal) * normal
        relative = velocity - along * normal - slide
        kept = max(0.0, 1 - friction * (new - along) / np.linalg.norm(relative))
        np.testing.assert_allclose(found, new * normal + slide + kept * relative, atol=1e-12)


def test_a_pushed_node_is_not_faster_along_the_surface_than_it_moved():
    rng = np.random.default_rng(12)
    cone = round_cone_shape(np.array([0.0, -0.3, 0]), np.array([0.0, 0.3, 0]), 0.2, 0.2)
    colliders = BodyPrimitives.from_primitives([(0, cone)], np.zeros((1, 3))).colliders
    h, slowed = 1 / 60, 0
    for _ in range(40):
        frames = [
            np.concatenate([turn.as_matrix(), rng.normal(0, 0.01, (3, 1))], axis=1)[None].copy()
            for turn in Rotation.from_rotvec(rng.normal(0, 0.05, (2, 3)))
        ]
        rest = np.array([*(0.2 * np.array([np.cos(1), np.sin(1)])), rng.uniform(-0.2, 0.2)])[[0, 2, 1]]
        before, after = (frame[0, :, :3] @ rest + frame[0, :, 3] for frame in frames)
        normal = frames[1][0, :, :3] @ (rest * [1, 0, 1] / 0.2)
        start, velocity = before + rng.normal(0, 0.01, 3), rng.normal(0, 1, 3)
        found = velocity.copy()
        collisions.limit_sliding_speed(colliders, 0, BodyMotion(*frames, h), start, after, found)
        body, flat = (after - before) / h, np.eye(3) - np.outer(normal, normal)
        assert (found - velocity) @ normal == pytest.approx(0, abs=1e-9)
        along, moved = flat @ (velocity - body), flat @ (before - start) / h
        shorter = moved if np.linalg.norm(moved) < np.linalg.norm(along) else along
        np.testing.assert_allclose(flat @ (found - body), shorter, atol=1e-9)
        slowed += shorter is moved
    assert 0 < slowed < 40


def test_first_contact_is_where_the_distance_falls_to_the_margin():
    a, b = np.array([0.1, -0.2, 0.05]), np.array([0.4, 0.3, -0.2])
    kind, shape = round_cone_shape(a, b, 0.3, 0.1)
    rng = np.random.default_rng(9)
    hits = 0
    for _ in range(200):
        start, end = rng.uniform(-1, 1, (2, 3))
        path = start + np.linspace(0, 1, 2001)[:, None] * (end - start)
        gaps = round_cone(path, a, b, 0.3, 0.1)[0] - 0.01
        if gaps[0] < 1e-3:
            continue
        found = collisions.first_contact(kind, shape[None], 0, 0.01, tuple(start), tuple(end))
        if (gaps < 0).any():
            hits += 1
            assert found == pytest.approx(np.argmax(gaps < 0) / 2000, abs=1e-3)
        elif gaps.min() > 1e-4:
            assert found > 1
    assert hits > 20


def test_measured_gaps_are_those_of_the_plain_reference_and_paths_are_never_too_short():
    rng = np.random.default_rng(8)
    shapes = []
    for _ in range(40):
        first, second = rng.uniform(0.02, 0.2, 2)
        # the last ones are balls: one end inside the other
        length = 0.9 * abs(first - second) if len(shapes) >= 30 else rng.uniform(0.21, 0.5)
        axis = rng.normal(size=3)
        start = rng.normal(0, 0.3, 3)
        shapes.append(round_cone_shape(start, start + length * axis / np.linalg.norm(axis), first, second)[1])
    primitives = BodyPrimitives.from_primitives([(0, (0, shape)) for shape in shapes], np.zeros((1, 3)))
    frames = []
    for _ in range(2):
        turn = np.linalg.qr(np.eye(3) + rng.normal(0, 0.1, (3, 3)))[0]
        turn *= np.sign(np.diag(turn))
        frames.append(np.concatenate([turn, rng.normal(0, 0.1, (3, 1))], axis=1)[None].copy())
    colliders = primitives.colliders
    placed = np.zeros((placed_kernels.PLACED, len(colliders.kinds)))
    placed_kernels.place_primitives(colliders, frames[0], frames[0], placed)
    placed_kernels.place_primitives(colliders, frames[0], frames[1], placed)
    (before,), (after,) = frames
    for _ in range(50):
        start, end = rng.normal(0, 0.4, (2, 3))
        placed_kernels.measure_gaps(placed, *start, *end)
        rest, was = (end - after[:, 3]) @ after[:, :3], (start - before[:, 3]) @ before[:, :3]
        for k, shape in enumerate(colliders.shapes):
            plain, _ = round_cone(rest[None], shape[:3], shape[3:6], shape[6], shape[7])
            assert placed[placed_kernels.GAP, k] == pytest.approx(plain[0], abs=1e-12)
        assert (placed[placed_kernels.PATH] >= np.linalg.norm(rest - was) - 1e-12).all()


@pytest.mark.parametrize("name", ["ball", "blunt cone"])
def test_a_chain_stays_outside_of_every_kind_of_primitive(name):
    shape = {
        "ball": round_cone_shape(np.zeros(3), np.zeros(3), 0.15, 0.15),
        "blunt cone": round_cone_shape(np.array([0, 0, 0.05]), np.zeros(3), 0.05, 0.15),
    }[name]
    primitives = BodyPrimitives.from_primitives([(0, shape)], np.zeros((1, 3)))
    line = np.column_stack([0.05 + 0.06 * np.arange(9), np.full(9, 0.3), np.zeros(9)])
    chains = RopeChains.free([line], RopeConstants(margin=0.002))
    x, v, tensions, touched = line, np.zeros_like(line), np.zeros(9), False
    motion = np.stack([line[:1], line[:1], np.zeros((1, 3)), np.zeros((1, 3))])
    for k in range(60):
        frames = []
        for t in (k / 60, (k + 1) / 60):
            c, s = np.cos(3 * t), np.sin(3 * t)
            frames.append(np.array([[[c, 0, s, 0.3 * s], [0, 1, 0, 0], [-s, 0, c, 0.1 * s]]]))
        x, v, tensions, hit = chains.advance(
            x, v, tensions, motion, 1 / 60, colliders=primitives.colliders, frames=(frames[0], frames[1])
        )
        touched |= hit.any()
        assert primitives.distances(x[1:], frames[1])[0].min() >= 0.002 - 2e-9
        assert chains.excess(x).max() <= 0.2 + 1e-9
    assert touched
