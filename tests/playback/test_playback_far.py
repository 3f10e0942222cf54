"""Far from the world's origin a garment is what it is near it, and no slower; what has no place there is refused."""

import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import hemline
from hemline import animators, garments
from hemline.animators import together
from hemline.animators.live.config import LiveConfig
from hemline.animators.live.wearable import Live
from hemline.animators.redressed import AnimatorRedressed
from hemline.animators.ropes.bones.chains import Ropes
from hemline.collide import inside
from hemline.errors import BadInput, BadMotion
from hemline.motions.motion import Motion, Pose
from hemline.playback.player.origin import FARTHEST_BODY, WORLD_ORIGIN, is_movable, origin_for
from hemline.playback.tally import Tally

DT = 1 / 30
PLACES = ([64000.0, 0.0, -128.0], [1e6, 0.0, -1e6], [-1e6, 640.0, 64.0])
"""A whole number of 64 m away: the local frames of clips that are moved by it are those of the clip, bit for bit."""
FOR_ANY_GARMENT = ("live", "lag", "skinned", "swingar")
ANIMATORS = ("cape", "cape at 0.25", "skirt", "tshirt-light", "worn together", "redressed", *FOR_ANY_GARMENT)


@pytest.fixture(scope="module")
def body():
    return hemline.bodies.load("anny24").shaped()


@pytest.fixture(scope="module")
def walk(body):
    """Its places are those that single precision has at 1,000 km, so that they can be moved there and stay the same."""
    walk = body.placed(hemline.motions.load("walk"))
    return [
        Pose(each.rotations, np.round(each.translation * 16).astype(np.float32) / 16)
        for each in (walk[n] for n in range(24))
    ]


def player_of(name, body):
    if name == "worn together":
        model = together([hemline.load("trousers-light"), hemline.load("tshirt-light")])
    elif name == "redressed":
        model = AnimatorRedressed(hemline.load("tshirt-light"), hemline.load("tshirt-light"))
        body = hemline.bodies.load("anny24").shaped([1.0])
    elif name in FOR_ANY_GARMENT:
        model = animators.load(name).animator_for(garments.load("tshirt-light"), body)  # type: ignore[union-attr]
    else:
        model = animators.load(name.split(" at ")[0])
    return hemline.Player.prepare(model, body, detail=0.25 if "0.25" in name else 1.0)  # type: ignore[arg-type]


def moved(pose, way):
    return Pose(pose.rotations, (pose.translation.astype(np.float64) + way).astype(np.float32))


def run(player, poses, way=(0.0, 0.0, 0.0), pre_roll=0.1):
    state, frames = player.start(moved(poses[0], way), pre_roll=pre_roll), []
    for pose in poses:
        state, frame = player.step(state, moved(pose, way), DT)
        frames.append(frame)
    return frames


@pytest.mark.parametrize("name", ANIMATORS)
def test_a_clip_far_away_has_the_same_garment_bit_for_bit(body, walk, name):
    player, frames = player_of(name, body), 4 if name in FOR_ANY_GARMENT else 8
    near = run(player, walk[:frames])
    assert is_movable(player.animator)
    for way in PLACES:
        for one, other in zip(near, run(player, walk[:frames], way), strict=True):
            assert other.origin == tuple(way)
            np.testing.assert_array_equal(one.vertices, other.local.vertices)
            np.testing.assert_array_equal(one.body.vertices, other.local.body.vertices)
            np.testing.assert_array_equal(other.local.body.joints[0], one.body.joints[0])


@pytest.mark.parametrize("name", ["cape", "tshirt-light"])
def test_frames_in_the_world_are_the_local_ones_moved_as_far_as_single_precision_goes(body, walk, name):
    way = np.array([1e6, 0.0, -1e6])
    frame = run(player_of(name, body), walk[:2], way)[-1]
    for here, there in (
        (frame.local.vertices, frame.vertices),
        (frame.local.animated, frame.animated),
        (frame.local.before_projection, frame.before_projection),
        (frame.local.body.joints, frame.body.joints),
    ):
        assert there.dtype == np.float32
        np.testing.assert_array_equal(there, (here + way).astype(np.float32))
    assert (
        np.abs(frame.body.vertices - (frame.local.body.vertices + way)).max() < 0.25
    )  # four steps of 6 cm: of the joints, of their sum, of the result
    np.testing.assert_array_equal(frame.body.pose.translation, moved(walk[1], way).translation)
    assert frame.local.local is frame.local and frame.body.origin == WORLD_ORIGIN


def test_near_the_origin_a_frame_is_its_own_local_one(body, walk):
    frame = run(player_of("cape", body), walk[:1], (60.0, 0.0, 0.0))[-1]
    assert frame.local is frame and frame.origin == WORLD_ORIGIN == frame.body.origin


@pytest.mark.parametrize("name", ["cape", "tshirt-light"])
def test_far_away_a_frame_takes_no_longer(body, walk, name):
    """At 1,000 km it took five seconds, at 100 km a tenth of one. The best of each run counts."""
    player = player_of(name, body)
    spans = {}
    for distance in (0.0, 1e2, 1e4, 1e5, 1e6):
        poses, times = [moved(pose, (distance, 0.0, -distance)) for pose in walk[:6]], []
        state = player.start(poses[0], pre_roll=0.0)
        for pose in poses:
            began = time.perf_counter()
            state, _ = player.step(state, pose, DT)
            times.append(time.perf_counter() - began)
        spans[distance] = min(times)
    assert max(spans.values()) < 3 * spans[0.0] + 0.01


@pytest.mark.parametrize("name", ANIMATORS)
def test_a_walk_past_the_border_of_an_origin_does_not_shake_the_cloth(body, walk, name):
    """The body walks from one origin into the next: cloth goes on as it does where there is no border."""
    player, frames = player_of(name, body), 8 if name in FOR_ANY_GARMENT else 16
    border = np.array([64.0 - float(walk[4].translation[0]) - 0.03, 0.0, 0.0])
    stride = [moved(pose, (0.03 * n, 0.0, 0.0)) for n, pose in enumerate(walk[:frames])]
    way = border - [0.03 * 4, 0.0, 0.0]
    near, far = run(player, stride), run(player, stride, way)
    origins = [frame.origin for frame in far]
    assert origins[0] == WORLD_ORIGIN and origins[-1] == (64.0, 0.0, 0.0)
    if name in ("live", "lag", "swingar"):  # the simulation takes another way where a place is rounded otherwise
        assert max(jumps(far)) < 1.5 * max(jumps(near)) + 0.005
        return
    for one, other in zip(near, far, strict=True):
        apart = (one.animated - one.body.joints[0]) - (other.local.animated - other.local.body.joints[0])
        assert np.linalg.norm(apart, axis=1).max() < 1e-3  # of rounding to a hundredth of a millimetre


def jumps(frames):
    """How far cloth goes from frame to frame, beside the pelvis, at the 99th percentile [m]."""
    placed = [frame.local.vertices - frame.local.body.joints[0] for frame in frames]
    return [np.percentile(np.linalg.norm(two - one, axis=1), 99) for one, two in pairwise(placed)]


@pytest.mark.parametrize("name", ["cape", "tshirt-light", "live"])
def test_a_body_that_is_put_a_thousand_kilometres_away_takes_its_garment_along(body, walk, name):
    player, far = player_of(name, body), (1e6, 0.0, 1e6)
    state = player.start(walk[0], pre_roll=0.1)
    for index in range(4):
        state, frame = player.step(state, moved(walk[index], far if index > 1 else (0.0, 0.0, 0.0)), DT)
        cloth, skin = frame.local.vertices, frame.local.body
        assert np.linalg.norm(cloth - skin.joints[0], axis=1).max() < 1.2
        within = inside(skin.vertices, skin.faces, cloth)
        within[frame.report.pinched] = False
        assert not within.any()
    assert frame.origin == far


def test_a_live_garment_finds_a_new_home_when_its_body_walks_far(body, walk):
    """Its simulation counts from where the body started: kilometres on, that must not blur or slow it either."""
    animator = player_of("live", body).animator
    state = animator.start(body.posed(walk[0]))
    for n in range(1, 4):
        here = moved(walk[n], (40.0 * n, 0.0, 0.0))
        state, vertices = animator.step(state, body.posed(here), DT)
        assert np.abs(state.pose.translation).max() < 64 + 1
        assert np.linalg.norm(vertices - here.translation, axis=1).max() < 1.2


def test_a_force_of_ones_own_gets_places_in_the_world(body, walk):
    cape, seen = hemline.load("cape"), []

    def hook(positions, velocities):
        seen.append(positions.mean(axis=0))
        return np.zeros_like(positions)

    assert isinstance(cape.ropes, Ropes)  # type: ignore[attr-defined]
    pushed = replace(cape, ropes=replace(cape.ropes, hook=hook))  # type: ignore[attr-defined, type-var]
    frame = run(hemline.Player.prepare(pushed, body), walk[:2], (1e6, 0.0, 0.0))[-1]
    assert frame.origin == (1e6, 0.0, 0.0)
    assert np.abs(np.array(seen) - [1e6, 1.0, 0.0]).max() < 3


def test_the_wind_of_a_place_is_that_of_the_world(body, walk):
    """Gusts are a field in the world: bodies that are played from two origins stand in one wind."""
    model = Live(LiveConfig(wind=(1.0, 0.0, 0.0), gusts=2.0))
    animator = model.animator_for(garments.load("tshirt-light"), body)
    player, seen = hemline.Player.prepare(animator, body), []
    proxy = animator._on(body)[0]
    wind = proxy._wind
    proxy._wind = lambda seconds, positions: (seen.append(positions.mean(axis=0)), wind(seconds, positions))[1]
    run(player, walk[:1], (1e6, 0.0, 0.0), pre_roll=0.0)
    assert np.abs(np.array(seen) - [1e6, 1.0, 0.0]).max() < 3


def test_simulated_vertices_drive_it_far_away_as_well(body, walk):
    player = player_of("cape", body)
    truth = run(player, walk[:3])
    state = player.start(moved(walk[0], (64000.0, 0.0, 0.0)), pre_roll=0.0)
    far = (truth[1].vertices + np.array([64000.0, 0.0, 0.0])).astype(np.float32)
    _, frame = player.follow(state, moved(walk[1], (64000.0, 0.0, 0.0)), DT, far)
    _, near = player.follow(player.start(walk[0], pre_roll=0.0), walk[1], DT, truth[1].vertices)
    assert np.abs(frame.local.animated - near.animated).mean() < 0.01  # the truth is rounded to 8 mm


def test_an_animator_that_cannot_be_moved_is_counted_from_where_it_started(body, walk):
    class Plain:
        def __init__(self, full):
            self.inner = full
            self.name, self.garment, self.body_name = full.name, full.garment, full.body_name
            self.body_hash, self.figures = full.body_hash, full.figures
            self.start, self.step, self.save = full.start, full.step, full.save

    plain = hemline.Player.prepare(Plain(hemline.load("cape")), body)  # type: ignore[arg-type]
    assert not is_movable(plain.animator) and not is_movable(together([hemline.load("tshirt-light"), plain.animator]))
    near = run(plain, walk[:4])
    for one, other in zip(near, run(plain, walk[:4], (1e6, 0.0, 0.0)), strict=True):
        np.testing.assert_array_equal(one.vertices, other.local.vertices)
    state = plain.start(walk[0], pre_roll=0.0)
    _, frame = plain.step(state, moved(walk[1], (100.0, 0.0, 0.0)), DT)
    assert frame.origin == WORLD_ORIGIN


def test_an_origin_is_kept_until_the_body_is_far_from_it():
    rotations = np.zeros((24, 4), np.float32)
    rotations[:, 0] = 1

    def at(x, before=WORLD_ORIGIN, y=0.0):
        return origin_for(Pose(rotations, np.array([x, y, 0.0], np.float32)), before)

    assert (
        at(0) == at(64) == at(-64) == WORLD_ORIGIN
        and at(65) == (64.0, 0.0, 0.0)
        and at(0, y=-100.0) == (0.0, -128.0, 0.0)
    )
    assert at(65, (128.0, 0.0, 0.0)) == (128.0, 0.0, 0.0) and at(63.9, (128.0, 0.0, 0.0)) == WORLD_ORIGIN
    assert at(20, (64.0, 0.0, 0.0)) == (64.0, 0.0, 0.0) and at(1e6) == (1e6, 0.0, 0.0)
    assert at(FARTHEST_BODY) == (FARTHEST_BODY, 0.0, 0.0)


@pytest.mark.parametrize("far", [1.1e6, 1e7, 1e12, 3e38])
def test_what_is_too_far_away_to_have_a_place_is_refused(body, walk, far):
    player = player_of("tshirt-light", body)
    state = player.start(walk[0], pre_roll=0.0)
    for axis in range(3):
        pose = moved(walk[1], far * np.eye(3)[axis])
        with pytest.raises(BadInput, match="a body is played within 1049 km of the world's origin; got a pelvis at"):
            player.step(state, pose, DT)
        with pytest.raises(BadInput, match="a body is played within 1049 km of the world's origin; got a pelvis at"):
            player.start(pose)


def test_a_pose_that_is_nowhere_is_refused(walk):
    for nowhere in (np.nan, np.inf, -np.inf):
        with pytest.raises(BadMotion, match="a motion must be finite"):
            moved(walk[0], (nowhere, 0.0, 0.0))


def test_figures_of_a_clip_far_away_are_those_of_the_clip(body, walk):
    near = Motion(
        np.array([pose.rotations for pose in walk[:8]]), np.array([pose.translation for pose in walk[:8]]), 30, 0.8
    )
    near = body.placed(near)
    near = replace(near, translations=np.round(near.translations * 16) / 16)
    far = replace(near, translations=near.translations + np.float32([1e6, 0.0, 1e6]))
    shirt = hemline.load("tshirt-light")
    one, other = (
        list(hemline.play(shirt, body, each, placed=True, pre_roll=0.1, measure=True)) for each in (near, far)
    )
    tallies = [Tally(shirt), Tally(shirt)]
    for tally, frames in zip(tallies, (one, other), strict=True):
        for frame in frames:
            tally.add(frame, None, 30.0)
    first, second = (tally.figures() for tally in tallies)
    for name in ("inside_percent", "edge_strain", "stretch_percent", "deepest_mm", "area_change_percent"):
        assert first[name] == second[name]
