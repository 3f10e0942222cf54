"""Frames that take no time, and frames after a pause: finite, as quick as others, and the garment where the body is."""

import time

import numpy as np
import pytest

import hemline
from hemline import animators, garments, metrics
from hemline.animators.redressed import AnimatorRedressed
from hemline.collide import inside
from hemline.errors import BadInput
from hemline.meshes import rest_lengths
from hemline.motions.motion import Pose
from hemline.motions.quaternions import from_axis_angle, multiply
from hemline.playback.player.time_step import LONGEST_STEP, SHORTEST_STEP, clamp_dt, run_up_steps

DT = 1 / 30
PAUSES = (0.3, 60.0, 3600.0, 1e6, 1e300)
MOMENTS = (9e-5, 1e-6, 1e-9, 1e-300, 5e-324)


@pytest.fixture(scope="module")
def body():
    return hemline.bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def walk(body):
    return body.placed(hemline.motions.load("walk"))


def played(body, walk, name, frames=12):
    """A player of a shipped model, and its state in the midst of a walk."""
    player = hemline.Player.prepare(hemline.load(name), body)
    state = player.start(walk[0], pre_roll=0.3)
    for index in range(frames):
        state, _ = player.step(state, walk[index], DT)
    return player, state


@pytest.fixture(scope="module")
def walking(body, walk):
    return {name: played(body, walk, name) for name in ("cape", "skirt", "tshirt-light")}


def long_edges(frame, garment):
    """Share of edges more than 30 % too long, those between two pins left out [percent]."""
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    kept = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    return metrics.stretch_percent(frame.vertices, edges[kept], lengths[kept])[1]


def check(player, frame, long=2.0):
    """Finite, about the body, none of it inside, hardly an edge too long."""
    frame = frame.local
    assert np.isfinite(frame.vertices).all()
    assert np.linalg.norm(frame.vertices - frame.body.joints[0], axis=1).max() < 1.6
    within = inside(frame.body.vertices, frame.body.faces, frame.vertices)
    within[frame.report.pinched] = False
    assert not within.any()
    assert long_edges(frame, player.garment) < long


def elsewhere(pose, way, yaw=0.0):
    rotations = pose.rotations.astype(np.float64)
    rotations[0] = multiply(from_axis_angle(np.array([0.0, yaw, 0.0])), rotations[0])
    return Pose(rotations, pose.translation + np.float32(way))


@pytest.mark.parametrize("name", ["cape", "skirt", "tshirt-light"])
def test_a_frame_after_a_pause_is_as_quick_as_others(walking, walk, name):
    """An hour took the cape a minute and a half, and Ctrl-C waited for its end. Here the best of three counts."""
    player, state = walking[name]
    for dt in (DT, *PAUSES):
        spans = []
        for _ in range(3):
            began = time.perf_counter()
            player.step(state, walk[12], dt)
            spans.append(time.perf_counter() - began)
        assert min(spans) < 0.5, f"{dt} s"  # 3 to 15 ms on a machine that does nothing else


@pytest.mark.parametrize("name", ["cape", "skirt", "tshirt-light"])
def test_the_garment_hangs_on_the_body_after_any_time(walking, walk, name):
    player, state = walking[name]
    for dt in (*PAUSES, *MOMENTS):
        after, frame = player.step(state, walk[12], dt)
        check(player, frame)
        _, frame = player.step(after, walk[13], DT)
        check(player, frame)


def test_all_pauses_are_alike_where_the_body_stays(walking, walk):
    """After an hour and after a year the same quarter of a second is played."""
    player, state = walking["cape"]
    here = Pose(walk[12].rotations, walk[11].translation)
    frames = [player.step(state, here, dt)[1].vertices for dt in (3600.0, 3.2e7, 1e300)]
    np.testing.assert_allclose(frames[1], frames[0], atol=1e-3)
    np.testing.assert_allclose(frames[2], frames[0], atol=1e-3)


@pytest.mark.parametrize("dt", [0.3, 1.0, 3600.0])
@pytest.mark.parametrize(("way", "yaw"), [((3.0, 0.0, 1.0), 0.0), ((3.0, 0.0, 1.0), np.pi), ((20.0, 2.0, -9.0), 2.0)])
def test_a_body_that_walked_on_in_a_pause_has_its_garment_with_it(walking, walk, dt, way, yaw):
    """No cloth is left behind, stretched or through the body, at once or in the frames after."""
    player, state = walking["cape"]
    for index in range(12, 20):
        state, frame = player.step(state, elsewhere(walk[index], way, yaw), dt if index == 12 else DT)
        check(player, frame, 10.0)
    assert long_edges(frame, player.garment) < 5.0


def test_an_hour_later_cloth_hangs_as_it_does_after_standing(walking, walk):
    """What is played is as slow as the body was: it stood nearly all of the hour, so the cape does not stream."""
    player, state = walking["cape"]
    pose = elsewhere(walk[11], (3.0, 0.0, 0.0))
    _, moved = player.step(state, pose, 3600.0)
    _, stayed = player.step(state, walk[11], 3600.0)
    apart = (moved.vertices - moved.body.joints[0]) - (stayed.vertices - stayed.body.joints[0])
    assert np.linalg.norm(apart, axis=1).max() < 0.02


def test_what_a_pause_plays_goes_on_smoothly_from_a_long_frame(walking, walk):
    """A frame a little longer than the longest one is hardly another one."""
    player, state = walking["cape"]
    pose = elsewhere(walk[12], (0.3, 0.0, 0.0))
    one, other = (player.step(state, pose, dt)[1].vertices for dt in (LONGEST_STEP, LONGEST_STEP * 1.0001))
    assert np.linalg.norm(one - other, axis=1).max() < 2e-3


@pytest.mark.parametrize("name", ["cape", "skirt"])
def test_two_calls_within_a_microsecond_do_not_throw_the_cloth(walking, walk, name):
    """The body may be a whole frame farther on: a way over a time of nothing is no speed."""
    player, state = walking[name]
    largest = {}
    for dt in (DT, 1e-6):
        after, before = player.step(state, walk[12], dt)
        moves = []
        for index in range(13, 20):
            after, frame = player.step(after, walk[index], DT)
            moved = (frame.vertices - frame.body.joints[0]) - (before.vertices - before.body.joints[0])
            moves.append(float(np.linalg.norm(moved, axis=1).max()))
            before = frame
        largest[dt] = max(moves)
    assert largest[1e-6] < 1.5 * largest[DT] + 0.02


@pytest.mark.parametrize("name", ["live", "lag", "skinned", "swingar"])
def test_animators_of_any_garment_take_any_time(body, walk, name):
    model = animators.load(name)
    assert isinstance(model, animators.Wearable)
    player = hemline.Player.prepare(model.animator_for(garments.load("tshirt-light"), body), body)
    state = player.start(walk[0], pre_roll=0.1)
    for dt in (3600.0, 1e-300):
        _, frame = player.step(state, elsewhere(walk[1], (3.0, 0.0, 1.0), 1.0), dt)
        check(player, frame, 5.0)


def test_what_no_animator_knows_how_to_move_is_played_too(body, walk):
    """An animator of another package: without `relocate` it gets the quarter of a second, and stays as it was."""

    class Plain:
        def __init__(self, full):
            self.full_one = full
            self.name, self.garment, self.body_name = full.name, full.garment, full.body_name
            self.body_hash, self.figures = full.body_hash, full.figures

        def start(self, posed):
            return self.full_one.start(posed)

        def step(self, state, posed, dt):
            assert SHORTEST_STEP <= dt <= LONGEST_STEP
            return self.full_one.step(state, posed, dt)

        def save(self, path):
            raise NotImplementedError

    player = hemline.Player.prepare(Plain(hemline.load("cape")), body)
    state = player.start(walk[0], pre_roll=0.1)
    for dt in (3600.0, 1e-300, DT):
        state, frame = player.step(state, walk[1], dt)
        check(player, frame)


def test_a_garment_redressed_on_another_shape_goes_along(walk):
    tall = hemline.bodies.load("anny24").shaped([1.5])
    both = AnimatorRedressed(hemline.load("tshirt-light"), hemline.load("tshirt-light"))
    player = hemline.Player.prepare(both, tall)
    state = player.start(walk[0], pre_roll=0.1)
    _, frame = player.step(state, elsewhere(walk[1], (3.0, 0.0, 1.0), 1.0), 3600.0)
    check(player, frame, 8.0)  # a large body stretches it


def test_times_that_are_none_are_refused_and_all_others_are_bounded():
    for dt in (0.0, -0.0, -1e-300, -1.0, float("nan"), float("inf"), -float("inf")):
        with pytest.raises(BadInput, match="a frame must take a positive time; got dt ="):
            clamp_dt(dt)
        with pytest.raises(BadInput, match="a frame must take a positive time; got dt ="):
            run_up_steps(1.0, dt)
    assert [clamp_dt(dt) for dt in (5e-324, 1e-4, 1 / 15, 0.25, 0.26, 1e300)] == [
        1e-4,
        1e-4,
        1 / 15,
        0.25,
        0.25,
        0.25,
    ]
    assert run_up_steps(1.0, 1e-300) == (1000, 1e-3) and run_up_steps(1.0, 3600.0) == (4, 0.25)
    assert run_up_steps(1.0, 1 / 30) == (30, 1 / 30) and run_up_steps(0.0, 1e-300) == (0, 1e-3)


def test_a_run_up_takes_no_more_steps_than_a_second_has_milliseconds(body, walk, walking):
    """The steps of a start are bounded, too: with 1e-300 s it asked for as many as nobody can count."""
    player, _ = walking["tshirt-light"]
    began = time.perf_counter()
    player.start(walk[0], pre_roll=0.05, dt=1e-300)
    assert time.perf_counter() - began < 5


def test_a_clip_of_few_frames_is_played_through_all_its_time(body, walk):
    """At two frames a second the cape swings as it does at eight: what lies between the frames is played, unseen."""
    cape, clip = hemline.load("cape"), walk[:91]
    few = list(hemline.play(cape, body, clip, fps=2, pre_roll=0.3, placed=True))
    more = list(hemline.play(cape, body, clip, fps=4, pre_roll=0.3, placed=True))
    assert len(few) == 7 and len(more) == 13
    for one, other in zip(few, more[::2], strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)
