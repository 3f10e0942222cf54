"""Ropes on a real body and cape: lengths, teleports, shapes, storing, hostile files."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from hemline import animators, bodies, garments, motions
from hemline.animators.ropes.bones.chains import Ropes
from hemline.animators.ropes.bones.embedding import Carriage, NodeEmbedding
from hemline.animators.ropes.bones.reading import read_ropes
from hemline.animators.ropes.fit.calibrate import _windows, bone_error_mm, calibrate
from hemline.animators.ropes.layout.layout import build_ropes
from hemline.animators.ropes.mechanics.constants import RopeConstants
from hemline.errors import BadDataset, BadInput, BadModel
from hemline.motions import Motion, Pose
from hemline.options import options_of


@functools.cache
def shaped(betas=()):
    return bodies.load("anny24").shaped(betas)


@functools.cache
def ropes():
    return build_ropes(garments.load("cape-light"), shaped(), chain_count=6, bone_counts=(8, 9))


@functools.cache
def clip(name, fps=60):
    return shaped().placed(motions.load(name).resample(fps))


def moved(pose, shift):
    return Pose(pose.rotations, pose.translation + np.asarray(shift, np.float32))


def test_carried_bones_are_where_the_embedding_is_at_rest():
    rest = shaped().posed(shaped().rest_pose)
    np.testing.assert_allclose(ropes().kinematic_positions(rest), ropes().rest[ropes().kinematic], atol=1e-6)
    np.testing.assert_allclose(ropes().positions_on(garments.load("cape-light").vertices), ropes().rest, atol=1e-6)


def test_embedding_of_many_frames_is_that_of_each():
    embedding = NodeEmbedding(np.array([[0, 2, 3], [1, 1, 2]], np.int32), np.array([[0.2, 0.3, 0.5], [1, 0, 0]]))
    clip_of = np.random.default_rng(0).normal(size=(5, 4, 3))
    found = embedding.positions_on(clip_of)
    np.testing.assert_allclose(found[:, 0], 0.2 * clip_of[:, 0] + 0.3 * clip_of[:, 2] + 0.5 * clip_of[:, 3])
    np.testing.assert_allclose(found[:, 1], clip_of[:, 1])
    np.testing.assert_allclose(embedding.positions_on(clip_of[2]), found[2])


def test_carrying_a_clip_is_carrying_each_pose():
    motion = clip("run")[:6]
    transforms, _ = shaped().transforms_of(motion.rotations, motion.translations)
    every = ropes().kinematic_paths(transforms, shaped())
    for frame in range(6):
        np.testing.assert_allclose(ropes().kinematic_positions(shaped().posed(motion[frame])), every[frame], atol=1e-6)


@pytest.mark.parametrize("fps", [120, 60, 30, 24])
def test_ropes_keep_their_length_and_stay_outside_on_a_run(fps):
    motion = clip("run", fps)
    state = ropes().start(shaped().posed(motion[0]))
    free = ropes().parents >= 0
    worst = 0.0
    for frame in range(1, min(len(motion), 2 * fps)):
        state = ropes().step(state, shaped().posed(motion[frame]), 1 / fps)
        excess = ropes().excess(state)
        worst = max(worst, excess[~state.touched].max())
        outside, _ = ropes().primitives.distances(state.positions, state.frames)
        margins = np.clip(ropes().chains.clearances, -0.05, ropes().constants.margin)
        assert (outside >= margins - 1e-6)[free].all()
        assert excess.max() <= 0.2 + 1e-9
    assert worst <= 1e-5


def test_a_state_can_be_kept_and_gone_back_to():
    motion = clip("run")
    state = ropes().start(shaped().posed(motion[0]))
    kept = state.copy()
    runs = []
    for _ in range(2):
        now = kept
        for frame in range(1, 12):
            now = ropes().step(now, shaped().posed(motion[frame]), 1 / 60)
        runs.append(now.positions.tobytes())
    assert runs[0] == runs[1]
    np.testing.assert_array_equal(state.positions, kept.positions)


def test_a_teleport_carries_the_ropes_along_and_forgets():
    motion = clip("run")
    state = ropes().start(shaped().posed(motion[0]))
    for frame in range(1, 10):
        state = ropes().step(state, shaped().posed(motion[frame]), 1 / 60)
    near = ropes().step(state, shaped().posed(motion[10]), 1 / 60)
    far = ropes().step(state, shaped().posed(moved(motion[10], [64, 0, -32])), 1 / 60)
    assert np.abs(far.positions - [64, 0, -32] - near.positions).max() < 0.1
    root = far.kinematic_velocities[-1]
    assert np.linalg.norm(far.velocities - root, axis=1).max() < 12


def test_a_garment_starts_out_moving_along():
    pose = clip("run")[0]
    bodies_of = [[shaped().posed(moved(pose, [0, 0, speed * k / 60])) for k in range(30)] for speed in (0.0, 4.0)]
    # the air is at rest and blows a moving cape back; without air both are the same
    calm = ropes().with_constants(RopeConstants(drag=0, air_drag=0, air_lift=0))
    ends = []
    for sequence in bodies_of:
        state = calm.start(sequence[0])
        for body in sequence[1:]:
            state = calm.step(state, body, 1 / 60)
        ends.append(state.positions - sequence[-1].joints[0])
    assert np.abs(ends[1] - ends[0]).max() < 2e-4  # float32 transforms


def test_other_shapes_carry_their_own_ropes():
    other = shaped((2.0, -1.0))
    posed = other.posed(other.rest_pose)
    state = ropes().start(posed)
    near = np.linalg.norm(other.vertices[None] - state.positions[ropes().kinematic, None], axis=2).min(1)
    assert near.max() < 0.03
    for _ in range(20):
        state = ropes().step(state, posed, 1 / 60)
    assert np.isfinite(state.positions).all()
    assert not np.array_equal(state.shapes, ropes().primitives.shapes)


def test_a_hook_pushes():
    blown = Ropes(**(fields_of(ropes()) | {"hook": lambda x, v: np.tile([0.0, 0.0, 3.0], (len(x), 1))}))
    posed = shaped().posed(shaped().rest_pose)
    ends = []
    for each in (ropes(), blown):
        state = each.start(posed)
        for _ in range(20):
            state = each.step(state, posed, 1 / 60)
        ends.append(state.positions[ropes().parents >= 0][:, 2].mean())
    assert ends[1] > ends[0] + 0.02


def fields_of(thing):
    return {name: getattr(thing, name) for name in type(thing).__dataclass_fields__}


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, np.inf, -np.inf])
def test_dt_must_be_positive(dt):
    posed = shaped().posed(clip("run")[0])
    with pytest.raises(BadInput, match="positive dt"):
        ropes().step(ropes().start(posed), posed, dt)


@pytest.mark.parametrize("dt", [5e-324, 1e-300, 1e-9, 10.1, 3600.0, 1e300])
def test_a_step_that_is_too_short_or_too_long_is_refused(dt):
    """An hour would take minutes that cannot be interrupted, 1e-300 s would divide by zero; a `Player` takes both."""
    posed = shaped().posed(clip("run")[0])
    with pytest.raises(BadInput, match=r"a step of ropes takes from 1e-06 to 10 s; got dt = .*with a Player"):
        ropes().step(ropes().start(posed), posed, dt)


def test_a_body_that_is_not_finite_is_refused():
    class Broken:
        transforms = np.full((24, 3, 4), np.nan, np.float32)

    posed = shaped().posed(clip("run")[0])
    with pytest.raises(BadInput, match="must be finite"):
        ropes().step(ropes().start(posed), Broken(), 1 / 60)  # type: ignore[arg-type]  # broken on purpose


def test_a_very_long_step_and_a_very_short_one_are_taken():
    motion = clip("run")
    state = ropes().start(shaped().posed(motion[0]))
    for dt in (1e-4, 0.5, 2.0):
        state = ropes().step(state, shaped().posed(motion[3]), dt)
        assert np.isfinite(state.positions).all()


@pytest.mark.parametrize(
    ("hook", "got"),
    [
        (lambda x, v: np.full_like(x, np.nan), "NaN or infinity"),
        (lambda x, v: np.zeros((3, 3)), r"shape \(3, 3\)"),
        (lambda x, v: 0.0, r"shape \(1,\)"),
    ],
)
def test_a_hook_that_returns_what_cannot_be_used_is_refused(hook, got):
    posed = shaped().posed(clip("run")[0])
    hooked = Ropes(**(fields_of(ropes()) | {"hook": hook}))
    with pytest.raises(BadInput, match=f"finite accelerations .* got {got}"):
        hooked.step(ropes().start(posed), posed, 1 / 60)


@pytest.mark.parametrize(
    ("shift", "dt"), [([0, 0, 0], 1.0), ([3, 0, 0], 1.0), ([3, 0, 0], 1 / 60), ([0, 3, 0], 0.2), ([0, 0, -3], 1 / 24)]
)
def test_ropes_are_whole_again_a_second_after_a_long_step_or_a_jump(shift, dt):
    motion = clip("walk")
    state = ropes().start(shaped().posed(motion[0]))
    for frame in range(20):
        state = ropes().step(state, shaped().posed(motion[frame]), 1 / 60)
    state = ropes().step(state, shaped().posed(moved(motion[40], shift)), dt)
    for frame in range(40, 100):
        state = ropes().step(state, shaped().posed(moved(motion[frame], shift)), 1 / 60)
    assert np.isfinite(state.positions).all()
    assert ropes().excess(state)[~state.touched].max() <= 1e-5
    assert ropes().excess(state).max() <= 0.2
    assert np.linalg.norm(state.velocities, axis=1).max() < 10


def test_arrays_and_back_play_the_same_bits():
    again = read_ropes(ropes().arrays(), ropes().metadata())
    posed = [shaped().posed(clip("run")[k]) for k in range(6)]
    runs = []
    for each in (ropes(), again):
        state = each.start(posed[0])
        for body in posed[1:]:
            state = each.step(state, body, 1 / 60)
        runs.append(state.positions.tobytes())
    assert runs[0] == runs[1]


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"offsets": None}, "lacks array 'offsets'"),
        ({"offsets": np.array([0, 1, 5], np.int32)}, "two nodes or more"),
        ({"offsets": np.array([], np.int32)}, "two nodes or more"),
        ({"lengths": np.zeros(3)}, r"'lengths' of the model must be float64 \(57,\)"),
        ({"lengths": "nan"}, "'lengths' of the model must be finite"),
        ({"rest": np.zeros((3, 3))}, r"'rest' of the model must be float64 \(57, 3\)"),
        ({"pairs": np.array([[0, 5000]], np.int32)}, "must count from 0"),
        ({"corners": "float"}, r"'corners' of the model must be int32 \(57, 3\)"),
        ({"masses": "zero"}, "positive lengths and masses"),
        ({"proxy_pivots": np.zeros((3, 3))}, "pivots|do not match"),
    ],
)
def test_damaged_ropes_are_refused(change, match):
    arrays = ropes().arrays()
    for name, value in change.items():
        if isinstance(value, str):
            value = arrays[name].astype(float) * {"zero": 0, "nan": np.nan, "float": 1}[value]
        arrays[name] = value
    with pytest.raises(BadModel, match=match):
        read_ropes({name: array for name, array in arrays.items() if array is not None}, ropes().metadata())


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"key_joint": "tail"}, "key joint"),
        ({"constants": None}, "metadata 'constants' of the model must be dict"),
        ({"constants": {"dragg": 1.0}}, "unknown rope constant 'dragg'; got 1.0; did you mean 'drag'"),
        ({"constants": {"drag": "much"}}, "rope constant 'drag' must be a finite number; got 'much'"),
    ],
)
def test_damaged_metadata_is_refused(change, match):
    with pytest.raises(BadModel, match=match):
        read_ropes(ropes().arrays(), ropes().metadata() | change)


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"drag": -1.0}, "'drag' must not be negative"),
        ({"friction": np.nan}, "'friction' must not be negative; got nan"),
        ({"gravity": (0, 1)}, "'gravity' must be a vector"),
        ({"wind": (0, np.inf, 0)}, "'wind' must be a vector"),
        ({"substep": 0.0}, "'substep' must be positive"),
        ({"tension_sweeps": -1}, "'tension_sweeps' must not be negative"),
        (
            {"position_push": "sideways"},
            "'position_push' must be one of a few; got 'sideways'; use one of gradient, hist",
        ),
        ({"velocity_push": "slide"}, "'velocity_push' must be one of a few"),
    ],
)
def test_constants_that_cannot_be_used_are_refused(change, match):
    with pytest.raises(BadModel, match=match):
        RopeConstants(**change)


def test_constants_and_back():
    constants = RopeConstants(wind=(1, 2, 3), position_push="history", tension_sweeps=5, position_update="project")
    assert options_of(RopeConstants, constants.as_dict()) == constants
    contact = constants.contact_settings()
    assert constants.step_settings()[1:] == (5, 0, True, contact)
    assert contact == (constants.friction, 1.0, 0.0)


def test_carriage_follows_the_nearest_skin():
    point = shaped().vertices[1234] + 0.004 * shaped().normals[1234]
    carriage = Carriage.of(point[None], shaped())
    np.testing.assert_allclose(carriage.weights.sum(1), 1)
    posed = shaped().posed(clip("run")[30])
    found = carriage.positions_in(posed.transforms, carriage.rest)
    assert np.linalg.norm(found[0] - posed.vertices[1234]) == pytest.approx(0.004, abs=0.002)


def swung(constants, motion):
    """Bones of ropes on given constants, as if simulated."""
    each = ropes().with_constants(constants)
    state = each.start(shaped().posed(motion[0]))
    bones = [state.positions]
    for frame in range(1, len(motion)):
        state = each.step(state, shaped().posed(motion[frame]), 1 / motion.fps)
        bones.append(state.positions)
    return np.array(bones)


def test_calibration_comes_closer_to_what_made_the_bones():
    motion = clip("turn", 30)[:50]
    truth = swung(replace(ropes().constants, lateral=2.0, parent_damping=30.0, bend_damping=5.0), motion)
    used = {"window_seconds": 0.4, "window_count": 3}
    before = bone_error_mm(ropes(), shaped(), [(motion, truth)], **used)
    found = calibrate(ropes(), shaped(), [(motion, truth)], **used)
    after = bone_error_mm(found, shaped(), [(motion, truth)], **used)
    assert after < 0.8 * before
    bound = 0.4 / found.constants.substep**2
    assert found.constants.lateral <= bound and found.constants.lateral_stretch <= bound
    physical = ("drag", "air_drag", "air_lift", "friction")
    assert all(getattr(found.constants, name) == getattr(ropes().constants, name) for name in physical)


def test_some_windows_are_those_in_which_the_body_moves_fastest():
    slow, fast = clip("turn", 30)[:90], clip("run", 30)[:40]
    clips = [(each, np.zeros((len(each), ropes().node_count, 3))) for each in (slow, fast)]
    windows = _windows(ropes(), shaped(), clips, 0.5, 3)
    ways = [np.linalg.norm(bodies[-1].joints[0] - bodies[0].joints[0]) for bodies, _, _ in windows]
    assert len(windows) == 3
    assert max(ways) > 1.0


def test_calibration_refuses_what_does_not_fit():
    motion = clip("turn", 30)[:50]
    with pytest.raises(BadDataset, match="bones of clip 0"):
        calibrate(ropes(), shaped(), [(motion, np.zeros((50, 3, 3)))])
    short = Motion(motion.rotations[:5], motion.translations[:5], 30, motion.leg_length)
    with pytest.raises(BadDataset, match="windows of a clip"):
        bone_error_mm(ropes(), shaped(), [(short, np.zeros((5, ropes().node_count, 3)))])


@pytest.mark.parametrize("name", ["dance", "kick", "turn"])
def test_no_rope_of_the_shipped_cape_is_stretched_by_more_than_a_fifth_where_the_body_catches_it(name):
    found = animators.load("cape").ropes
    motion, longest, touched = clip(name, 30), 0.0, False
    state = found.start(shaped().posed(motion[0]))
    for frame in range(len(motion)):
        state = found.step(state, shaped().posed(motion[frame]), 1 / 30)
        longest, touched = max(longest, found.excess(state).max()), touched or state.touched.any()
    assert touched and longest <= 0.2 + 1e-9
