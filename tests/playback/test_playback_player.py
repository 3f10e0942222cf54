"""The player: what `play` shows, for whoever writes a loop of his own; and many of them at once."""

import copy
from dataclasses import replace

import igl
import numpy as np
import pytest

import hemline
from hemline import metrics
from hemline.compiled import threads, use_threads
from hemline.errors import BadInput, BadModel
from hemline.meshes import rest_lengths

DT = 1 / 30


@pytest.fixture(scope="module")
def cape():
    return hemline.load("cape")


@pytest.fixture(scope="module")
def kick():
    return hemline.motions.load("kick")[20:44]


def body(betas=()):
    return hemline.bodies.load("anny24").shaped(betas)


def looped(player, motion, frames, **start):
    """The vertices of the first frames of a loop of one's own."""
    state, shown = player.start(motion[0], **start), []
    for index in range(frames):
        state, frame = player.step(state, motion[index], DT)
        shown.append(frame)
    return state, shown


def test_a_loop_of_ones_own_shows_what_play_shows(cape, kick):
    shaped = body([1.0, -0.5])
    placed = shaped.placed(kick)
    player = hemline.Player.prepare(cape, shaped, placed=True)
    _, mine = looped(player, placed, 8, pre_roll=0.2, dt=DT)
    theirs = list(hemline.play(cape, shaped, placed[:8], fps=None, pre_roll=0.2, placed=True))
    for own, frame in zip(mine, theirs, strict=True):
        np.testing.assert_array_equal(own.vertices, frame.vertices)


def test_poses_of_a_clip_are_placed_on_the_body(cape, kick):
    """A clip for longer legs on a shorter body: the feet are on the floor as in the placed clip, bit for bit."""
    shaped = body([-2.0])
    player = hemline.Player.prepare(cape, shaped)
    _, (frame,) = looped(player, kick, 1, pre_roll=0.0)
    np.testing.assert_array_equal(frame.body.vertices, shaped.posed(shaped.placed(kick)[0]).vertices)
    made = hemline.motions.Pose(kick[0].rotations, kick[0].translation)  # of no clip: taken as it is
    _, (unplaced,) = looped(player, [made], 1, pre_roll=0.0)
    np.testing.assert_array_equal(unplaced.body.vertices, shaped.posed(made).vertices)
    assert np.abs(unplaced.body.vertices - frame.body.vertices).max() > 0.02


def test_nothing_is_inside_in_a_loop_of_ones_own_by_another_library(cape, kick):
    player = hemline.Player.prepare(cape, body())
    _, frames = looped(player, kick, 16, pre_roll=0.3)
    before = 0
    for frame in frames[::5]:
        skin, faces = frame.body.vertices.astype(np.float64), frame.body.faces.astype(np.int64)
        winding = igl.winding_number(skin, faces, frame.vertices.astype(np.float64))
        winding[frame.report.pinched] = 0
        assert np.abs(winding).max() < 0.5
        before += int((np.abs(igl.winding_number(skin, faces, frame.animated.astype(np.float64))) > 0.5).sum())
    assert before > 0  # or the projection had nothing to do


def test_an_old_state_is_a_rollback(cape, kick):
    player = hemline.Player.prepare(cape, body())
    state, _ = looped(player, kick, 6, pre_roll=0.0)
    kept = copy.deepcopy(state)
    for index in (6, 7, 8):
        _, first = player.step(state, kick[index], DT)
    _, again = player.step(state, kick[8], DT)
    _, copied = player.step(kept, kick[8], DT)
    np.testing.assert_array_equal(first.vertices, again.vertices)
    np.testing.assert_array_equal(first.vertices, copied.vertices)


def long_edges(frame, garment):
    """Share of edges more than 30 % too long, those between two pins left out [percent]."""
    edges, lengths = rest_lengths(garment.faces, garment.rest_edges)
    kept = ~np.isin(edges, garment.pins.vertices).all(axis=1)
    return metrics.stretch_percent(frame.vertices, edges[kept], lengths[kept])[1]


def test_the_cloth_stays_in_one_piece_where_the_animator_tears_it(cape, kick):
    torn, whole = (
        looped(hemline.Player.prepare(cape, body(), whole=each), kick, 24, pre_roll=0.3)[1] for each in (False, True)
    )
    before = np.mean([long_edges(frame, cape.garment) for frame in torn])
    after = np.mean([long_edges(frame, cape.garment) for frame in whole])
    assert before > 0.2  # or there is nothing to hold together
    assert after < 0.3 * before
    np.testing.assert_array_equal(torn[0].before_projection, torn[0].animated)


def test_cloth_is_whole_and_swings_from_the_first_frame_on(cape):
    """The run begins at speed, an arm behind the back: after the run-up the cape streams and no arm is through it."""
    run = hemline.motions.load("run")
    player = hemline.Player.prepare(cape, body())
    _, frames = looped(player, run, 6)
    assert max(long_edges(frame, cape.garment) for frame in frames) < 0.1
    hem = cape.rest[:, 1] < np.percentile(cape.rest[:, 1], 10)
    behind = (frames[0].vertices[hem] - frames[0].body.joints[0])[:, [0, 2]].mean(axis=0)
    ahead = (run.translations[1] - run.translations[0])[[0, 2]]
    assert behind @ ahead / np.linalg.norm(ahead) < -0.3
    _, standing = looped(player, run, 1, pre_roll=0.0)
    assert long_edges(standing[0], cape.garment) > 0.1  # without it an arm is through the cloth


def test_a_jump_and_a_long_frame_are_over_within_a_second(cape):
    """The body jumps by three metres, then a frame takes a second: no stretched edge a second later."""
    walk = hemline.motions.load("walk")
    player = hemline.Player.prepare(cape, body())
    state, _ = looped(player, walk, 5, pre_roll=0.3)
    far = [hemline.motions.Pose(walk[n].rotations, walk[n].translation + np.float32([3, 0, 1])) for n in range(5, 40)]
    for dt in (DT, 1.0):
        moving, _ = player.step(state, far[0], dt)
        for pose in far[1:31]:
            moving, frame = player.step(moving, pose, DT)
        assert long_edges(frame, cape.garment) < 0.1
        assert np.linalg.norm(frame.vertices - frame.body.joints[0], axis=1).max() < 2.0


def test_every_stage_is_timed_and_compiling_is_apart(cape, kick):
    player = hemline.Player.prepare(cape, body())
    assert 0 < player.warm_up(kick[0]) < 300
    _, (frame,) = looped(player, kick, 1, pre_roll=0.0)
    assert list(frame.milliseconds) == ["body", "animator", "whole", "cover", "projection"]
    assert all(span > 0 for span in frame.milliseconds.values())


def test_a_crowd_shows_what_each_player_shows_alone(cape, kick, all_threads):
    shapes = [(), (1.5,), (-1.0, 1.0)]
    players = [hemline.Player.prepare(cape, body(betas)) for betas in shapes]
    alone = [player.start(kick[n], pre_roll=0.0) for n, player in enumerate(players)]
    together = list(alone)
    for step in range(1, 4):
        poses = [kick[n + step] for n in range(3)]
        together, frames = hemline.crowd(players, together, poses, DT)
        for n, (player, pose) in enumerate(zip(players, poses, strict=True)):
            alone[n], frame = player.step(alone[n], pose, DT)
            np.testing.assert_array_equal(frames[n].vertices, frame.vertices)


def test_a_crowd_does_not_depend_on_the_threads(cape, kick, all_threads):
    players = [hemline.Player.prepare(cape, body())] * 4
    states = [players[0].start(kick[n], pre_roll=0.0) for n in range(4)]
    before, shown = threads(), []
    try:
        for count in (1, 2):
            use_threads(count)
            shown.append(hemline.crowd(players, states, [kick[5]] * 4, DT)[1])
    finally:
        use_threads(before)
    for one, two in zip(*shown, strict=True):
        np.testing.assert_array_equal(one.vertices, two.vertices)


def test_wrong_input_is_refused(cape, kick):
    player = hemline.Player.prepare(cape, body())
    state = player.start(kick[0], pre_roll=0.0)
    for dt in (0.0, -0.1, float("nan"), float("inf")):
        with pytest.raises(BadInput, match="a frame must take a positive time; got dt ="):
            player.step(state, kick[0], dt)
        with pytest.raises(BadInput, match="a frame must take a positive time; got dt ="):
            player.start(kick[0], dt=dt)
    for pre_roll in (-1.0, 601.0, float("nan"), float("inf")):
        with pytest.raises(BadInput, match="a pre-roll takes a time from 0 to 600 s; got pre_roll ="):
            player.start(kick[0], pre_roll=pre_roll)
    with pytest.raises(BadInput, match="a state and a pose for each player; got 2 players, 1 states, 2 poses"):
        hemline.crowd([player] * 2, [state], [kick[0]] * 2, DT)
    with pytest.raises(BadModel, match="was fitted on body 'anny24'"):
        from dataclasses import replace

        hemline.Player.prepare(cape, replace(body().body, name="other").shaped())


def test_a_body_changes_its_shape_under_a_close_fitting_garment(kick):
    """The animator shows at once what a player that was prepared on that body shows, and nothing gets inside."""
    shirt, shapes = hemline.load("tshirt-light"), ([0.0], [1.5, -1.0], [-0.5, 2.0])
    first = hemline.Player.prepare(shirt, body(shapes[0]))
    others = [hemline.Player.prepare(shirt, body(betas)) for betas in shapes]
    anew = [looped(other, kick, 24)[1] for other in others]
    player, state = first, first.start(kick[0])
    for index in range(24):
        shape = index // 4 % len(shapes)
        player, state = player.reshape(state, body(shapes[shape]))
        state, frame = player.step(state, kick[index], DT)
        np.testing.assert_array_equal(frame.animated, anew[shape][index].animated)
        within = igl.fast_winding_number(
            frame.body.vertices.astype(float), frame.body.faces, frame.vertices.astype(float)
        )
        assert not (np.delete(within, frame.report.pinched) > 0.5).any()


def test_only_garments_of_settled_states_change_their_body(cape, kick):
    player = hemline.Player.prepare(cape, body())
    with pytest.raises(BadInput, match="garments of settled states alone; got animator 'ropes'"):
        player.reshape(player.start(kick[0], pre_roll=0.0), body([1.0]))
    shirt, known = hemline.Player.prepare(hemline.load("tshirt-light"), body()), body().body
    stranger = replace(known, name="stranger", template=np.float32(1.01) * known.template)
    with pytest.raises(BadInput, match="was fitted on body anny24"):
        shirt.reshape(shirt.start(kick[0], pre_roll=0.0), stranger.shaped())
