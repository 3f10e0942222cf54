"""The correction of the ropes' bones: zero at rest, better than none or silent, in a wind as on a moving body."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from hemline.animators.ropes.bones.body_inputs import REST_INPUTS, BodyAtRest, body_inputs
from hemline.animators.ropes.bones.bone_limit_kernels import limit_bones
from hemline.animators.ropes.bones.bone_source import SMOOTHING_SECONDS
from hemline.animators.ropes.fit.correction import fit_correction, worst_correction
from hemline.animators.ropes.fit.fit import choose_correction
from hemline.animators.ropes.fit.training_set import MeshNetworks
from hemline.learning.key_frame import to_key_frame
from hemline.learning.mlp import Mlp
from hemline.motions import Pose
from hemline.motions.quaternions import from_axis_angle, rotate
from tests.animators.swaying import swaying_frames

from tests.contract.made_models import body, ropes_model, walk  # isort: skip

KEY, H = 9, 1 / 30


@pytest.fixture(scope="module")
def frames():
    return swaying_frames()


def error_mm(frames, correction) -> float:
    test = frames.test
    made = frames.rope_bones[test] + correction(frames.rope_bones[test], frames.body[test])
    return 1e3 * float(np.linalg.norm((made - frames.bones[test]).reshape(len(test), -1, 3), axis=2).mean())


def held_out(frames, correction) -> np.ndarray:
    """Corrected bones of the held-out frames."""
    some = frames.side > 0
    return frames.rope_bones[some] + correction(frames.rope_bones[some], frames.body[some])


def test_what_bones_and_body_tell_is_found_and_carried_bones_stay(frames):
    """Ropes swing less far than the cloth, and hang aside by what the body does: both are linear."""
    random = np.random.default_rng(0)
    aside = 0.02 * random.normal(size=(len(REST_INPUTS), len(frames.free)))
    slack = 0.7 * frames.bones - ((frames.body - REST_INPUTS) @ aside * frames.free).astype(np.float32)
    off = replace(frames, rope_bones=slack.astype(np.float32))
    found = fit_correction(off, 30)
    quiet = found.with_zero_output()
    blind = replace(found, low=REST_INPUTS, high=REST_INPUTS)  # sees no motion of the body
    assert error_mm(off, found) < 0.35 * error_mm(off, quiet)
    assert error_mm(off, found) < 0.6 * error_mm(off, blind)
    assert not found(slack, frames.body)[:, frames.free == 0].any()


def test_nothing_is_corrected_at_rest(frames):
    """Ropes hang 5 cm off in all frames of the training: the drape at rest stays where it is nevertheless."""
    off = replace(frames, rope_bones=frames.bones - np.float32(0.05) * frames.free)
    found = fit_correction(off, 20)
    assert np.abs(found(off.rope_bones[:5], frames.body[:5])).max() > 0.01
    assert not found(np.zeros(len(frames.free), np.float32), REST_INPUTS).any()


def test_a_body_beyond_the_training_is_corrected_as_at_its_limit(frames):
    off = replace(frames, rope_bones=0.7 * frames.bones)
    found = fit_correction(off, 20)
    wild = np.where(frames.body[0] > 0, 100.0, -100.0)
    limit = np.where(frames.body[0] > 0, found.high, found.low)
    assert_array_equal(found(off.rope_bones[0], wild), found(off.rope_bones[0], limit))


def test_a_correction_that_is_no_better_on_validation_is_silenced(frames):
    """Ropes hang 5 cm off: a correction that moves them back is kept, its opposite is disabled."""
    off = replace(frames, rope_bones=frames.bones - np.float32(0.05) * frames.free)
    rows, width = frames.displacements.shape[1], len(frames.free)
    # the mesh is a linear map of the bones, as a network: relu(x) - relu(-x) = x
    matrix = np.random.default_rng(1).normal(size=(6, width)) / np.sqrt(width)
    both = np.concatenate([np.eye(width), -np.eye(width)])
    network = Mlp.from_weights(
        [both, np.eye(2 * width), np.concatenate([matrix, -matrix], axis=1)],
        [np.zeros(2 * width), np.zeros(2 * width), np.zeros(6)],
    )
    basis = np.linalg.lstsq(network.many(frames.bones), frames.displacements, rcond=None)[0].astype(np.float32)
    assert basis.shape == (6, rows)
    mesh = MeshNetworks((network,), basis)
    good = fit_correction(off, 20)
    for given, kept in ((good, True), (replace(good, matrix=-good.matrix), False)):
        found, figures = choose_correction(off, mesh, given, held_out(off, given))
        assert (found is given) == kept and found.matrix.any() == kept
        assert (figures["val_corrected_error_mm"] < figures["val_uncorrected_error_mm"]) == kept
        assert (figures["val_worst_correction"] < 1) == kept
    blind = replace(off, side=np.zeros_like(off.side))
    found, figures = choose_correction(blind, mesh, given, held_out(blind, given))
    assert found is given and not figures


def turned(frames, angle: float, shift) -> np.ndarray:
    turn = from_axis_angle(np.array([0.0, angle, 0.0]))
    columns = [rotate(turn, frames[..., c]) for c in range(4)]
    moved = np.stack(columns, axis=-1)
    moved[..., 3] += shift
    return moved


def test_a_wind_is_seen_as_a_body_that_moves_against_it():
    """Galilei: air or body may be at rest. A turn of both about the vertical is not seen."""
    then, now = (body().posed(walk()[k]).transforms.astype(np.float64) for k in (3, 4))
    at_rest, wind = BodyAtRest(KEY, body().joints.astype(np.float64)), np.array([1.0, 0.5, -2.0])
    with_wind = body_inputs(at_rest, then, now, H, tuple(wind))
    carried = now.copy()
    carried[..., 3] -= H * wind
    assert_allclose(with_wind, body_inputs(at_rest, then, carried, H), atol=1e-9)
    turn = from_axis_angle(np.array([0.0, 0.8, 0.0]))
    again = body_inputs(
        at_rest, turned(then, 0.8, [3, 0, 1]), turned(now, 0.8, [3, 0, 1]), H, tuple(rotate(turn, wind))
    )
    assert_allclose(with_wind, again, atol=1e-9)
    assert not np.allclose(with_wind, body_inputs(at_rest, then, now, H))


def test_a_body_that_stands_in_its_rest_pose_has_the_inputs_of_rest():
    at_rest = BodyAtRest(KEY, body().joints.astype(np.float64))
    still = body_inputs(at_rest, *[body().posed(body().rest_pose).transforms.astype(np.float64)] * 2, H)
    assert_allclose(still, REST_INPUTS, atol=1e-6)


def test_a_body_that_is_put_elsewhere_is_seen_as_one_that_stands():
    """Five metres in a thirtieth of a second are no motion of 150 m/s: the correction stays where it was going."""
    model = ropes_model()
    first = body().posed(walk()[3])
    away = body().posed(Pose(walk()[4].rotations, walk()[4].translation + np.float32([5, 0, 0])))
    there, _ = model.source.step(model.source.start(first), away, H, model.ropes.rest)
    ropes, share = there.ropes, -np.expm1(-H / SMOOTHING_SECONDS)
    at_rest = BodyAtRest(model.ropes.key_index, ropes.pivots)
    moved = (to_key_frame(ropes.frames[at_rest.key], ropes.positions) - model.ropes.rest).astype(np.float32).reshape(-1)
    standing = model.correction(moved, body_inputs(at_rest, ropes.frames, ropes.frames, H))
    assert_allclose(there.change, share * standing, atol=1e-6)
    assert np.abs(there.change).max() > 1e-4


def test_playing_sees_the_body_as_the_fit_does():
    """The kernel of a step, and the NumPy of the fit, in a wind."""
    model = ropes_model()
    ropes = model.ropes.with_constants(replace(model.ropes.constants, wind=(1.0, -0.5, 2.0)))
    source, (first, second) = replace(model.source, ropes=ropes), (body().posed(walk()[k]) for k in (3, 4))
    before = ropes.start(first)
    after = ropes.step(before, second, H)
    at_rest = BodyAtRest(ropes.key_index, after.pivots)
    expected = body_inputs(at_rest, before.frames, after.frames, H, (1.0, -0.5, 2.0))
    assert_allclose(source._body_inputs(after, before.frames, H), expected, atol=1e-12)


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


def test_a_correction_that_tears_the_bones_apart_is_held_back():
    """What plays keeps to the lengths of the ropes, whatever the correction says."""
    model = ropes_model()
    wild = replace(model.correction, matrix=100 * np.ones_like(model.correction.matrix))
    source, rest = replace(model.source, correction=wild), model.ropes.rest
    state = source.start(body().posed(walk()[0]))
    _, moved = source.step(state, body().posed(walk()[1]), H, rest)
    positions, free = rest + moved.reshape(-1, 3), np.flatnonzero(model.ropes.parents >= 0)
    assert np.abs(moved).max() > 0.3
    spans = np.linalg.norm(positions[free] - positions[model.ropes.parents[free]], axis=1)
    assert (spans <= 1.1 * model.ropes.lengths[free] + 1e-5).all()


def test_the_worst_take_is_told_from_the_mean(frames):
    """Of two validation takes one hangs as the simulation does: there nothing can be better than no correction."""
    two = replace(frames, side=np.where(frames.take >= 8, 1, 0).astype(np.int32))
    slack = np.where((two.take == 9)[:, None], two.bones, 0.7 * two.bones).astype(np.float32)
    off = replace(two, rope_bones=slack)
    found = fit_correction(off, 20)
    one = replace(off, side=np.where(two.take == 8, 1, np.where(two.take == 9, 2, 0)).astype(np.int32))
    assert worst_correction(one, held_out(one, found)) < 1 < worst_correction(off, held_out(off, found))
    assert worst_correction(one, held_out(one, found.with_zero_output())) == 1


def test_the_correction_is_followed_with_a_time_constant_at_any_frame_rate(monkeypatch):
    """A correction that is switched on: after a fifth of a second as much of it is there at any frame rate."""
    model, pose = ropes_model(), body().posed(walk()[10])
    offset = np.where((model.ropes.parents >= 0).repeat(3), 0.02, 0).astype(np.float32)
    monkeypatch.setattr(type(model.correction), "__call__", lambda *_: offset)
    expected = (1 - np.exp(-0.2 / SMOOTHING_SECONDS)) * offset
    for steps in (4, 12, 48):
        state = model.source.start(pose)
        for _ in range(steps):
            state, _ = model.source.step(state, pose, 0.2 / steps, model.ropes.rest)
        assert_allclose(state.change, expected, rtol=1e-4)
