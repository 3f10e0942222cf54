"""The gain of the swing: bones swing as far as in the simulation, and hang in the mean where they did."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from hemline.animators.ropes.bones.bone_correction import MOST_GAIN, BoneCorrection
from hemline.animators.ropes.bones.bone_source import SWING_SECONDS
from hemline.animators.ropes.bones.bones import rest_bones
from hemline.animators.ropes.fit.gather import TakeFrames
from hemline.animators.ropes.fit.swing import with_swing_gain
from hemline.datasets import Take, create
from hemline.errors import BadModel
from hemline.learning.key_frame import to_key_frame

from tests.contract.made_models import body, ropes_model, walk  # isort: skip

FPS = 30.0


def played(source, motion):
    """Displacements of all bones in a motion before and after distances are limited (frames, bones, 3)."""
    model, shown, free = ropes_model(), [], source.ropes.parents >= 0
    rest = rest_bones(source.ropes, model.rest, body())
    state, unlimited = source.start(body().posed(motion[0])), []
    for frame in range(len(motion)):
        posed = body().posed(motion[frame])
        state, each = source.step(state, posed, 1 / FPS, rest)
        key = posed.transforms[model.key].astype(np.float64)
        local = to_key_frame(key, state.ropes.positions)
        local[free] = to_key_frame(key, state.tracked.positions)
        unlimited.append(local - rest)
        shown.append(each.reshape(-1, 3))
    return np.array(unlimited), np.array(shown)


def slow_mean(moved):
    """The mean of the last `SWING_SECONDS`, by SciPy."""
    share = 1 - np.exp(-1 / FPS / SWING_SECONDS)
    return lfilter([share], [1, share - 1], moved, axis=0)


def with_gain(gain):
    source = ropes_model().source
    return replace(source, correction=replace(source.correction, swing_gain=gain))


def test_the_deviation_from_a_slow_mean_is_multiplied_and_carried_bones_stay():
    source, motion = with_gain(1.2), walk(60)
    plain, shown = played(source, motion)
    free = source.ropes.parents >= 0
    swing = free[:, None] * (plain - slow_mean(plain))
    assert np.abs(swing).max() > 0.02
    rest = rest_bones(source.ropes, ropes_model().rest, body())
    for expected, each in zip((plain + 0.2 * swing).astype(np.float32), shown, strict=True):
        assert_allclose(source._limit(expected.reshape(-1), rest).reshape(-1, 3), each, atol=2e-5)


def test_where_bones_come_to_hang_does_not_depend_on_the_gain():
    first = walk()[:1]
    still = np.repeat(first.rotations, 240, axis=0), np.repeat(first.translations, 240, axis=0)
    motion = replace(first, rotations=still[0], translations=still[1])
    (_, plain), (_, more) = (played(with_gain(gain), motion) for gain in (1.0, MOST_GAIN))
    assert np.abs(plain[20] - more[20]).max() > 1e-3
    assert_allclose(plain[-1], more[-1], atol=1e-4)


@pytest.mark.parametrize(("given", "found"), [(1.0, 1.0), (1.12, 1.12), (1.6, MOST_GAIN), (0.5, 1.0)])
def test_the_gain_of_takes_is_found(tmp_path, given, found):
    """Takes in which bones are those of the model, but for a gain of the swing."""
    model, motion = ropes_model(), walk(60)
    source = model.source
    plain = replace(source, correction=replace(source.correction, swing_gain=1.0))
    _, moved = played(plain, motion)
    moved = moved + (given - 1) * (moved - slow_mean(moved))
    data = create(tmp_path / "data", model.garment)
    pose = body().rest_pose
    still = replace(motion[:1], rotations=pose.rotations[None], translations=pose.translation[None])
    data.add(take_of(model, "rest", still, model.rest[None]))
    data.add(take_of(model, "clip", motion, mesh_of(model, moved, motion)))
    takes = TakeFrames.of(data)
    assert with_swing_gain(takes, plain).swing_gain == pytest.approx(found, abs=2e-3)


def mesh_of(model, moved, motion):
    """Vertices at which the bones, each on a vertex or between three, have these displacements (frames, verts, 3)."""
    embedding, rest = model.ropes.embedding, rest_bones(model.ropes, model.rest, body())
    assert len(np.unique(embedding.corners[:, 0])) == len(embedding.corners)
    frames = []
    for frame, each in enumerate(moved):
        key = body().posed(motion[frame]).transforms[model.key]
        local = np.array(model.rest, np.float64)
        weights = np.zeros((len(rest), len(local)))
        np.add.at(weights, (np.arange(len(rest))[:, None], embedding.corners), embedding.barycentric)
        local += np.linalg.lstsq(weights, each + rest - weights @ local, rcond=None)[0]
        frames.append(local @ key[:, :3].T + key[:, 3])
    return np.array(frames, np.float32)


def take_of(model, kind, motion, vertices):
    count = len(motion)
    inputs = {"garment": model.garment.hash, "clip": "walk" if kind == "clip" else "", "subject": "a", "part": 0}
    quiet = np.zeros(count, bool), np.zeros(count, np.int32)
    return Take(kind, vertices, motion, body().betas, *quiet, {"edge_strain_p99": 0.02}, inputs)


def test_a_file_without_a_gain_has_one_and_a_wild_one_is_refused():
    correction = ropes_model().correction
    arrays, rows = correction.arrays(), correction.modes.shape[1]
    assert BoneCorrection.of(arrays, rows=rows).swing_gain == correction.swing_gain == 1.125
    without = {name: array for name, array in arrays.items() if name != "swing_gain"}
    assert BoneCorrection.of(without, rows=rows).swing_gain == 1
    for wild in (0.9, 2.0, -1.0):
        with pytest.raises(BadModel, match="the swing of a model is multiplied by 1 to 1.25"):
            BoneCorrection.of(arrays | {"swing_gain": np.array([wild], np.float32)}, rows=rows)
    assert correction.with_zero_output().swing_gain == 1
