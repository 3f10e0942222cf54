"""Laws of the learned bones: what a closed loop with ropes in reserve must keep whatever its network."""

import math
from dataclasses import replace

import numpy as np
import pytest

from hemline.animators.ropes.bones import bone_source
from hemline.animators.ropes.bones.body_input_kernels import write_body_inputs
from hemline.animators.ropes.bones.body_inputs import (
    BODY_INPUT_COUNT,
    INPUT_JOINTS,
    REST_INPUTS,
    BodyAtRest,
    body_inputs,
)
from hemline.animators.ropes.bones.bone_contact_kernels import push_points_out
from hemline.animators.ropes.bones.bone_limit_kernels import limit_bones
from hemline.animators.ropes.bones.learned_bones import LearnedBones
from hemline.learning.mlp import Mlp
from hemline.motions import Motion
from tests.contract.made_models import body, learned_model, ropes_model, turned_about_the_vertical, vertical, walk

H = 1 / 30


def at_rest() -> BodyAtRest:
    return BodyAtRest(ropes_model().ropes.key_index, body().joints.astype(np.float64))


def transforms(motion: Motion) -> np.ndarray:
    return body().transforms_of(motion.rotations, motion.translations)[0].astype(np.float64)


def steps(learned: LearnedBones, frames: np.ndarray, dt: float, state=None) -> tuple[np.ndarray, list]:
    """Free bones (frames, free, 3) after each of some poses, and the states."""
    ropes = ropes_model().ropes
    free = np.flatnonzero(ropes.parents >= 0)
    if state is None:
        state = learned.start(ropes.start(body().posed(body().rest_pose)).positions[free], frames[0])
    found, states = [], []
    for each in frames:
        margins = np.full(len(free), learned.clearance)
        made = learned.step(state, at_rest(), ropes.rest[free], margins, ropes.primitives.colliders, each, dt)
        state = made.state
        found.append(made.positions)
        states.append(state)
    return np.stack(found), states


def made() -> LearnedBones:
    learned = learned_model().learned
    assert learned is not None
    return learned


def silent(clearance: float) -> LearnedBones:
    """All directions, and a network that says nothing: bones are free bodies without weight."""
    rows, count = made().modes.shape[1], BODY_INPUT_COUNT
    far = np.full(count + 2 * rows, 9.0, np.float32)
    sizes = ((4, count + 2 * rows), (4, 4), (rows, 4))
    network = Mlp.from_weights([np.zeros(size) for size in sizes], [np.zeros(size[0]) for size in sizes])
    modes = np.eye(rows, dtype=np.float32)
    return replace(made(), modes=modes, network=network, low=-far, high=far, clearance=clearance)


def played(model, poses, dt=H, state=None) -> tuple[np.ndarray, list]:
    posed = [body().posed(pose) for pose in poses]
    state = model.start(posed[0]) if state is None else state
    frames, states = [], []
    for each in posed:
        state, vertices = model.step(state, each, dt)
        frames.append(vertices)
        states.append(state)
    return np.stack(frames), states


def poses_of(motion: Motion) -> list:
    return [motion[k] for k in range(len(motion))]


def test_without_a_network_every_bone_keeps_its_velocity_in_the_world():
    frames = transforms(walk())
    _, states = steps(silent(-1.0), frames[:2], H)
    thrown = replace(states[-1], positions=states[-1].positions + np.array([[[0.0, 0, 0]], [[0.02, 0.01, -0.03]]]))
    found, _ = steps(silent(-1.0), frames[2:], H, thrown)
    way = thrown.positions[1] - thrown.positions[0]
    expected = thrown.positions[1] + way * np.arange(1, len(found) + 1)[:, None, None]
    np.testing.assert_allclose(found, expected, atol=1e-5)  # the body's turns are float32


def test_inputs_of_the_body_do_not_say_where_in_the_world_it_stands_or_looks():
    motion, shift = walk(4), np.array([3.0, 0.5, -2.0])
    poses = [turned_about_the_vertical(motion[k], 2.0, shift) for k in range(4)]
    elsewhere = np.stack([body().posed(pose).transforms for pose in poses]).astype(np.float64)
    one, other = (body_inputs(at_rest(), *frames[:3], H, H) for frames in (transforms(motion), elsewhere))
    assert one.shape == (BODY_INPUT_COUNT,)
    np.testing.assert_allclose(one, other, atol=2e-4)  # poses are float32, velocities divided by a frame


def test_one_frame_sees_what_many_see():
    """The kernel of a frame against the twin in NumPy that the training uses; the last step shorter than the others."""
    frames = transforms(walk(5))
    for k in range(3):
        expected = body_inputs(at_rest(), *frames[k : k + 3], H, 0.4 * H)
        found = np.empty(BODY_INPUT_COUNT)
        write_body_inputs(at_rest().joints, at_rest().key, INPUT_JOINTS, frames[k:], frames[k + 2], H, 0.4 * H, found)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_at_rest_inputs_are_gravity_alone():
    still = np.tile(np.eye(4)[:3], (24, 1, 1))
    inputs = body_inputs(at_rest(), still, still, still, H, H)
    np.testing.assert_allclose(inputs[:3], [0, -1, 0])
    np.testing.assert_allclose(inputs[3:], 0, atol=1e-12)


def test_full_steps_are_the_same_at_any_frame_rate():
    """Twice as many frames pass through the same full steps; where frames fall between them, nearly."""
    motion = walk(31)
    slow, begun = steps(made(), transforms(motion), H)
    fast, _ = steps(made(), transforms(motion.resample(60))[1:], H / 2, begun[0])
    np.testing.assert_allclose(fast[1::2][:30], slow[1:], atol=1e-6)
    film, _ = steps(made(), transforms(motion.resample(24))[1:], 1 / 24, begun[0])
    assert np.linalg.norm(film[23] - slow[30], axis=1).max() < 0.02
    assert np.ptp(slow[:, -1], axis=0).max() > 0.3  # the hem went a long way


def test_a_frame_in_between_lies_on_a_smooth_way():
    motion = walk(40)
    fine = transforms(motion.resample(240))
    found, _ = steps(made(), fine, 1 / 240)
    local = np.stack([(x - f[12, :, 3]) @ f[12, :, :3] for x, f in zip(found, fine, strict=True)])
    leaps = np.abs(np.diff(local, axis=0)).max(axis=(1, 2))
    around = np.convolve(leaps, np.ones(9) / 9, "valid")
    assert (leaps[4:-4] < 3 * around + 5e-4)[8:].all()


def test_a_teleport_carries_bones_and_their_swing_along():
    motion, angle, shift = walk(30), 1.0, np.array([40.0, 1.0, -30.0])
    model = learned_model()
    here, _ = played(model, poses_of(motion))
    jumped = [motion[k] if k < 15 else turned_about_the_vertical(motion[k], angle, shift) for k in range(len(motion))]
    # the jump takes the place of the body's way in that frame: the pose before it is shown again, elsewhere
    jumped.insert(15, turned_about_the_vertical(motion[14], angle, shift))
    there, states = played(model, jumped)
    assert max(float(state.bones.ropes_weight) for state in states) == 0
    back = (there[16:] - shift) @ vertical(angle)
    reach = np.linalg.norm(here[15:] - here[15:].mean(axis=1, keepdims=True), axis=2).max()
    assert np.linalg.norm(back - here[15:], axis=2).mean() < 0.05 * reach


def test_a_body_that_stands_still_in_its_rest_pose_leaves_every_bone_where_it_hangs_settled():
    """Also bones that rest nearer to the body's primitives than others may come."""
    model = learned_model(clearance=0.08)
    learned, free = model.learned, np.flatnonzero(model.ropes.parents >= 0)
    assert learned is not None
    assert (model.ropes.chains.clearances[free] < 0.05).any()
    seen = np.concatenate([REST_INPUTS, np.zeros(len(learned.low) - BODY_INPUT_COUNT, np.float32)])
    model = replace(model, learned=replace(learned, network=learned.network.with_zero_at(seen)))
    posed = body().posed(body().rest_pose)
    state, rest = model.source.start(posed), model.ropes.rest
    for _ in range(60):
        state, moved = model.source.step(state, posed, H, rest)
    assert np.abs(moved.reshape(-1, 3)[free]).max() < 1e-5


def test_bones_cannot_run_away_farther_than_in_the_training():
    """A network that blows up: coefficients stay in their range, and ropes take over."""
    wild = replace(made().network, biases=(*made().network.biases[:2], made().network.biases[2] + 5))
    near = np.full(len(made().low), 0.3, np.float32)
    near[:BODY_INPUT_COUNT] = 9
    learned = replace(made(), network=wild, low=-near, high=near)
    found, _ = steps(learned, transforms(walk()), H)
    rest = ropes_model().ropes.rest[np.flatnonzero(ropes_model().ropes.parents >= 0)]
    for bones, frame in zip(found, transforms(walk()), strict=True):
        local = (bones - frame[12, :, 3]) @ frame[12, :, :3] - rest
        assert np.abs(learned.modes @ local.reshape(-1)).max() < 0.3 + 0.05  # pushed out of the body after that
    _, states = played(replace(learned_model(), learned=learned), poses_of(walk()))
    assert float(states[-1].bones.ropes_weight) == 1


def test_a_minute_goes_by_without_drift():
    model, pose = learned_model(), walk()[20]
    vertices, _ = played(model, [pose] * 1800)
    np.testing.assert_allclose(vertices[-1], vertices[600], atol=1e-4)


def test_no_bone_stays_nearer_to_the_body_than_the_clearance():
    motion, ropes = walk(), ropes_model().ropes
    frames = transforms(motion)
    close, _ = steps(replace(made(), clearance=-1.0), frames, H)
    found, _ = steps(replace(made(), clearance=0.06), frames, H)
    near = [ropes.primitives.distances(x, f)[0].min() for x, f in zip(close, frames, strict=True)]
    assert min(near) < 0.05
    distances = [ropes.primitives.distances(x, f)[0].min() for x, f in zip(found, frames, strict=True)]
    assert min(distances) > 0.06 - 2e-3  # where two primitives meet the last push may leave a little


def test_the_push_goes_the_shortest_way_out_of_the_deepest_primitive():
    primitives, frames = ropes_model().ropes.primitives, transforms(walk())[7]
    random = np.random.default_rng(0)
    points = body().posed(walk()[7]).joints[random.integers(0, 24, 200)] + 0.1 * random.normal(size=(200, 3))
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


@pytest.mark.parametrize("change", ["wind", "hook", "gravity"])
def test_forces_that_learned_bones_do_not_know_mean_ropes(change):
    model, poses = learned_model(), poses_of(walk(20))
    if change == "hook":
        ropes = replace(model.ropes, hook=lambda x, v: np.full_like(x, 0.5))
    else:
        value = (2.0, 0.0, 1.0) if change == "wind" else (0.0, -1.6, 0.0)
        ropes = model.ropes.with_constants(replace(model.ropes.constants, **{change: value}))
    both, alone = replace(model, ropes=ropes), replace(model, ropes=ropes, learned=None)
    np.testing.assert_array_equal(played(both, poses)[0], played(alone, poses)[0])


def test_out_of_the_range_of_the_training_ropes_take_over_and_give_back_without_a_jump():
    still, model = walk(1)[0], learned_model(1.05)
    wild = walk(60, fps=8.0)
    poses = [still] * 30 + poses_of(wild) + [wild[59]] * 120
    frames, states = played(model, poses)
    shares = np.array([float(state.bones.ropes_weight) for state in states])
    assert shares[29] == 0 and shares.max() == 1 and shares[-1] == 0
    assert np.abs(np.diff(shares)).max() <= H / 0.2 + 1e-9
    free = np.stack([(x - p.translation) for x, p in zip(frames, poses, strict=True)])
    leaps = np.linalg.norm(np.diff(free, axis=0), axis=2).max(axis=1)
    changing = (np.diff(shares) != 0) & (np.arange(len(leaps)) > 92)
    assert changing.any()
    assert leaps[changing].max() < 0.05


def test_while_they_are_not_asked_ropes_rest_and_learned_bones_follow():
    model = learned_model()
    _, states = played(model, poses_of(walk(5)))
    assert states[-1].bones.ropes is states[0].bones.ropes
    roped = learned_model(0.001)
    _, states = played(roped, poses_of(walk(30)))
    end = states[-1].bones
    assert float(end.ropes_weight) == 1
    free = np.flatnonzero(roped.ropes.parents >= 0)
    np.testing.assert_array_equal(end.learned.positions[1], end.ropes.positions[free])


def test_while_ropes_take_over_learned_bones_are_drawn_to_them(monkeypatch):
    model, poses = learned_model(0.001), poses_of(walk(9))
    _, states = played(model, poses[:8])
    posed, free = body().posed(poses[8]), np.flatnonzero(model.ropes.parents >= 0)
    drawn = model.step(states[-1], posed, H)[0].bones
    monkeypatch.setattr(bone_source, "SECONDS_TO_FOLLOW", math.inf)
    alone = model.step(states[-1], posed, H)[0].bones
    share = float(drawn.ropes_weight)
    assert 0.3 < share < 0.9
    away = drawn.ropes.positions[free] - alone.learned.positions[1]
    assert np.abs(away).max() > 1e-3
    expected = alone.learned.positions[1] + (1 - math.exp(-share * H / 0.1)) * away
    np.testing.assert_allclose(drawn.learned.positions[1], expected, atol=1e-12)


def limited(positions, sweeps=1):
    """Bones after sweeps of the limit, and the largest excess before."""
    chains, moved = ropes_model().ropes.chains, positions.copy()
    spans = chains.pair_spans[:, 1]
    worst = limit_bones(chains.parents, chains.lengths, chains.pairs, spans, 1.1, 1.02, sweeps, moved)
    return moved, worst


def plainly_limited(positions):
    """One sweep by plain NumPy."""
    chains, moved = ropes_model().ropes.chains, positions.copy()
    free = (chains.parents >= 0).astype(float)
    for (a, b), most in zip(chains.pairs, 1.02 * chains.pair_spans[:, 1], strict=True):
        along, both = moved[b] - moved[a], free[a] + free[b]
        span = np.linalg.norm(along)
        if span > most and both:
            pull = (1 - most / span) / both * along
            moved[a], moved[b] = moved[a] + free[a] * pull, moved[b] - free[b] * pull
    for i in np.flatnonzero(free):
        along, most = moved[i] - moved[i - 1], 1.1 * chains.lengths[i]
        if np.linalg.norm(along) > most:
            moved[i] = moved[i - 1] + most / np.linalg.norm(along) * along
    return moved


def test_bones_come_no_farther_apart_than_the_cloth_allows():
    ropes = ropes_model().ropes
    strewn = ropes.rest + np.random.default_rng(3).normal(0, 0.1, ropes.rest.shape)
    once, worst = limited(strewn)
    np.testing.assert_allclose(once, plainly_limited(strewn), atol=1e-12)
    assert worst > 0.1
    free = np.flatnonzero(ropes.parents >= 0)
    spans = np.linalg.norm(once[free] - once[free - 1], axis=1)
    assert (spans <= 1.1 * ropes.lengths[free] + 1e-12).all()
    np.testing.assert_array_equal(once[ropes.kinematic], strewn[ropes.kinematic])
    kept, none = limited(ropes.rest)
    assert none == 0
    np.testing.assert_array_equal(kept, ropes.rest)


def test_a_network_that_tears_the_bones_apart_is_held_back():
    """Bones that move apart by themselves: what plays keeps to the lengths of the ropes, and goes on from there."""
    model = learned_model()
    state, ropes = model.start(body().posed(walk()[0])), model.ropes
    free = np.flatnonzero(ropes.parents >= 0)
    away = np.zeros((2, len(free), 3))
    away[1, ::2, 0] = 0.3  # every other bone flies off by 9 m/s
    learned = replace(state.bones.learned, positions=state.bones.learned.positions + away)
    state = replace(state, bones=replace(state.bones, learned=learned))
    posed = body().posed(walk()[1])
    state, _ = model.step(state, posed, H)
    positions = np.empty((ropes.node_count, 3))
    positions[ropes.kinematic], positions[free] = ropes.kinematic_positions(posed), state.bones.learned.positions[1]
    spans = np.linalg.norm(positions[free] - positions[free - 1], axis=1)
    assert (spans <= 1.1 * ropes.lengths[free] + 1e-9).all()


@pytest.mark.parametrize("make", [ropes_model, lambda: learned_model(0.001)])
def test_ropes_that_leave_each_other_are_shown_together(make):
    """Chains side by side that fly apart: bones are shown no farther apart than the cloth between them allows."""
    model = replace(make(), correction=make().correction.with_zero_output())
    state, ropes = model.start(body().posed(walk()[0])), model.ropes
    bones, chains = state.bones, model.ropes.chains
    free = np.flatnonzero(ropes.parents >= 0)
    flying = bones.ropes.positions.copy()
    flying[free, 0] += 0.4 * np.sign(flying[free, 0])
    bones = replace(bones, ropes=replace(bones.ropes, positions=flying), ropes_weight=np.asarray(1.0))
    posed = body().posed(walk()[1])
    after, moved = model.source.step(bones, posed, H, state.rest_bones)

    def excess(positions: np.ndarray) -> float:
        a, b = chains.pairs.T
        return float((np.linalg.norm(positions[a] - positions[b], axis=1) / chains.pair_spans[:, 1]).max())

    assert excess(after.ropes.positions) > 1.5
    assert excess(state.rest_bones + moved.reshape(-1, 3)) < 1.1
